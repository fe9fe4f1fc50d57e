"""Ctrl-C, SIGTERM and a closed terminal: how they end a program, and blocks that they wait for."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


class Interrupted(KeyboardInterrupt):
    """The program was asked to stop.

    Attributes:
        code: the exit code that shells know it by: 130 after Ctrl-C, 143 after SIGTERM.
    """

    def __init__(self, number: int) -> None:
        super().__init__()
        self.code = 128 + number


class _Deferral:
    """How many blocks defer signals, and the first signal that came meanwhile.

    Python handles signals on the main thread only, so nothing here needs a lock.
    """

    def __init__(self) -> None:
        self.blocks = 0
        self.signal: int | None = None

    def handle(self, number: int, frame: FrameType | None) -> None:
        del frame
        if not self.blocks:
            raise Interrupted(number)
        self.signal = number if self.signal is None else self.signal


_deferral = _Deferral()


@contextmanager
def interruptible() -> Iterator[None]:
    """Within the block Ctrl-C, SIGTERM and SIGHUP raise `Interrupted`, so that files are closed.

    A signal that the program was started to ignore (as `nohup` does) stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():  # signals go to that one only
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    handled = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    try:
        for number in handled:
            signal.signal(number, _deferral.handle)
        yield
    finally:
        for number in handled:
            signal.signal(number, before[number])


class interrupts_deferred:  # noqa: N801  # reads as the function that it stands for
    """Within the block, inside `interruptible`, signals wait until the block has ended.

    It changes no signal handler: a show enters it every frame, and six changes take 0.1 ms.
    """

    __slots__ = ("_counts",)

    def __enter__(self) -> None:
        self._counts = threading.current_thread() is threading.main_thread()
        _deferral.blocks += self._counts

    def __exit__(self, *exc: object) -> None:
        _deferral.blocks -= self._counts
        if self._counts and not _deferral.blocks and _deferral.signal is not None:
            number, _deferral.signal = _deferral.signal, None
            raise Interrupted(number)
