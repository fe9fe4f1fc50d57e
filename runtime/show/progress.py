"""How far a long work has come, told on the terminal and nowhere else."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Self, TextIO

from tqdm import tqdm

_PATIENCE = 10.0  # [s] before a log or a pipe hears of it
_STEPS = 10  # lines that a log or a pipe gets, at most


class Progress:
    """A bar on a terminal; elsewhere a line at every tenth, once the work proves to be long.

    Writes to standard error only, so that standard output can be piped; a reader that goes away
    or a closed stream is no error.

    Args:
        label: what is done.
        total: how many steps it takes, or None when nobody knows.
        stream: where to write; standard error.
        clock: tells the time [s].
    """

    def __init__(
        self,
        label: str,
        total: int | None,
        *,
        stream: TextIO | None = None,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self._label, self._total = label, total
        self._stream = sys.stderr if stream is None else stream
        self._clock, self._start = clock, clock()
        self._done = self._told = 0
        self._bar: tqdm | None = None
        if self._on_terminal():
            self._bar = tqdm(
                desc=label, total=total, file=self._stream, unit=" frames", dynamic_ncols=True
            )

    def advance(self, steps: int = 1, *, said: str = "") -> None:
        """Say that `steps` more steps are done, and on a terminal what else is `said`."""
        self._done += steps
        with suppress(OSError, ValueError):  # nobody listens any more, or the stream is closed
            if self._bar is not None:
                self._bar.set_postfix_str(said, refresh=False)
                self._bar.update(steps)
            else:
                self._tell()

    def close(self) -> None:
        """Leave the terminal on a fresh line; may be called twice."""
        bar, self._bar = self._bar, None
        if bar is not None:
            with suppress(OSError, ValueError):
                bar.close()

    def _tell(self) -> None:
        if not self._total or self._stream is None:
            return
        tenth = min(_STEPS * self._done // self._total, _STEPS)
        if tenth > self._told and self._clock() - self._start >= _PATIENCE:
            self._told = tenth
            self._stream.write(f"{self._label}: {100 * tenth // _STEPS} %\n")
            self._stream.flush()

    def _on_terminal(self) -> bool:
        try:
            return self._stream is not None and self._stream.isatty()
        except ValueError:  # closed
            return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
