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


@contextmanager
def interruptible() -> Iterator[None]:
    """A block that Ctrl-C, SIGTERM and SIGHUP leave with `Interrupted`, so that files are closed.

    A signal that the program was started to ignore (as `nohup` does) stays ignored.
    """

    def leave(number: int, frame: FrameType | None) -> None:
        del frame
        raise Interrupted(number)

    heard = [number for number in _ASKING if signal.getsignal(number) is not signal.SIG_IGN]
    with _handled(dict.fromkeys(heard, leave)):
        yield


@contextmanager
def held() -> Iterator[None]:
    """A block that is finished before anybody is listened to, such as one that writes a file."""
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        del frame
        came.append(number)

    heard = [number for number in _ASKING if callable(signal.getsignal(number))]
    try:
        with _handled(dict.fromkeys(heard, note)):
            yield
    finally:
        if came:
            signal.raise_signal(came[0])


@contextmanager
def _handled(handlers: dict[signal.Signals, signal._HANDLER]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():  # signals go to that one only
        yield
        return
    before = {number: signal.getsignal(number) for number in handlers}
    try:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
