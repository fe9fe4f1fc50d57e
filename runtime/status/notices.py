"""Notices: the latest things that happened in a show, each in one line, for some seconds."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

MOST = 4  # lines at once
SHOWN = 4.0  # [s] that a line is shown
LONGEST = 200  # characters of a line


@dataclass(frozen=True, slots=True)
class Notice:
    """One line.

    Attributes:
        text: what happened.
        since: [s] when, by the host's monotonic clock.
        fault: whether something went wrong.
    """

    text: str
    since: float
    fault: bool = False


class Notices:
    """Passes on what happens in a show, from any thread, and keeps the latest of it.

    Args:
        tell: takes one line of what happened.
        warn: takes one line about a fault.
        clock: host monotonic time [s].
    """

    def __init__(
        self,
        tell: Callable[[str], None],
        warn: Callable[[str], None],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._tell, self._warn, self._clock = tell, warn, clock
        self._lines: deque[Notice] = deque(maxlen=MOST)
        self._lock = threading.Lock()

    def tell(self, text: str) -> None:
        """Tell what happened, on the panel and beyond."""
        self.show(text)
        self._tell(text)

    def warn(self, text: str) -> None:
        """Tell what went wrong, on the panel and beyond."""
        self.show(text, fault=True)
        self._warn(text)

    def show(self, text: str, *, fault: bool = False) -> None:
        """Add a line to the panel alone; the same line again begins its time anew."""
        text = " ".join(text.split())
        if len(text) > LONGEST:
            text = text[: LONGEST - 1] + "…"
        notice = Notice(text, self._clock(), fault)
        with self._lock:
            if self._lines and self._lines[-1].text == text:
                self._lines.pop()
            self._lines.append(notice)

    @property
    def current(self) -> list[Notice]:
        """The lines that are shown now, oldest first."""
        now = self._clock()
        with self._lock:
            return [line for line in self._lines if now - line.since < SHOWN]

    @property
    def latest(self) -> Notice | None:
        """The newest line, however old."""
        with self._lock:
            return self._lines[-1] if self._lines else None


class SecondPress:
    """Whether something was asked for a second time, soon after the first.

    Args:
        clock: host monotonic time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._first = -math.inf

    def again(self) -> bool:
        """Return whether this is the second time; else it is the first."""
        now = self._clock()
        second = now - self._first < SHOWN
        self._first = -math.inf if second else now
        return second
