"""The progress of a long task: a bar on a terminal, a few lines in a log."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Self, TextIO

from tqdm import tqdm

_PATIENCE = 10.0  # [s] before the first line in a log or a pipe
_STEPS = 10  # lines in a log or a pipe, at most


class Progress:
    """A progress bar on a terminal; elsewhere a line for every tenth of a long work.

    It writes to standard error only, so that standard output can be piped. A reader that goes away
    or a closed stream is no error.

    Args:
            label: the work.
        total: number of steps, or None if it is not known.
    unit: the name of a step, in the plural.
        stream: where to write; standard error if None.
        clock: monotonic time [s].
    """

    def __init__(
        self,
        label: str,
        total: int | None,
        *,
        unit: str = "frames",
        stream: TextIO | None = None,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self._label, self._total = label, total
        self._stream = sys.stderr if stream is None else stream
        self._clock, self._start = clock, clock()
        self._done = self._tenths = 0
        self._bar: tqdm | None = None
        if self._on_terminal():
            self._bar = tqdm(
                desc=label, total=total, file=self._stream, unit=f" {unit}", dynamic_ncols=True
            )

    def advance(self, steps: int = 1, *, said: str = "") -> None:
        """Count `steps` more steps; a terminal shows the text `said` beside the bar."""
        self._done += steps
        with suppress(OSError, ValueError):  # the reader is gone, or the stream is closed
            if self._bar is not None:
                self._bar.set_postfix_str(said, refresh=False)
                self._bar.update(steps)
            else:
                self._write_tenth()

    def close(self) -> None:
        """End the bar with a new line; may be called twice."""
        bar, self._bar = self._bar, None
        if bar is not None:
            with suppress(OSError, ValueError):
                bar.close()

    def _write_tenth(self) -> None:
        if not self._total or self._stream is None:
            return
        tenth = min(_STEPS * self._done // self._total, _STEPS)
        if tenth > self._tenths and self._clock() - self._start >= _PATIENCE:
            self._tenths = tenth
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
