"""Being asked to stop: by Ctrl-C, by the system, by a closed terminal - and when to listen."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_ASKING = tuple(
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


class _Asked:
    """Who asked while a block was held; signals are only ever handled on the main thread."""

    def __init__(self) -> None:
        self.held = 0
        self.by: int | None = None

    def note(self, number: int, frame: FrameType | None) -> None:
        del frame
        if not self.held:
            raise Interrupted(number)
        self.by = number if self.by is None else self.by


_asked = _Asked()


@contextmanager
def interruptible() -> Iterator[None]:
    """A block that Ctrl-C, SIGTERM and SIGHUP leave with `Interrupted`, so that files are closed.

    A signal that the program was started to ignore (as `nohup` does) stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():  # signals go to that one only
        yield
        return
    before = {number: signal.getsignal(number) for number in _ASKING}
    heard = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    try:
        for number in heard:
            signal.signal(number, _asked.note)
        yield
    finally:
        for number in heard:
            signal.signal(number, before[number])


class held:  # noqa: N801  # reads as the function that it stands for
    """A block within `interruptible` that is finished before anybody is listened to.

    It changes no signal handler: a show does this every frame, and six changes take 0.1 ms.
    """

    __slots__ = ("_counts",)

    def __enter__(self) -> None:
        self._counts = threading.current_thread() is threading.main_thread()
        _asked.held += self._counts

    def __exit__(self, *exc: object) -> None:
        _asked.held -= self._counts
        if self._counts and not _asked.held and _asked.by is not None:
            number, _asked.by = _asked.by, None
            raise Interrupted(number)
