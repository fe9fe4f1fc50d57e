"""Which messages make one frame, in protocols that have no mark for it (VMC, VRChat)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from statistics import median

HALF = 0.5  # of a period without anything ends a frame
# [s] that end one at least and at most. What waited in a queue comes faster than it was sent, and
# says nothing of the period; senders of more than 125 Hz are told by the parts that come again.
SHORTEST_GAP, LONGEST_GAP = 0.004, 0.25
FEWEST_PERIODS, KEPT_PERIODS = 2, 9
REMEMBERED_FRAMES = 30  # a part that none of these had is not waited for


class FrameAssembly:
    """Says when the parts that came make a frame.

    A frame ends (a) when a time or status comes after parts, (b) when a part comes again, (c) when
    nothing has come for half a period, as the protocol's receivers do it; and, so that nobody waits
    for the next frame to know that this one is whole, (d) at the end of the datagram with which
    every part is there that lately was.

    Attributes:
        parts: the parts of the frame that is being put together.
        newest: arrival [s] of its last part.
    """

    def __init__(self) -> None:
        self.parts: set[int] = set()
        self.newest = 0.0
        self._began = 0.0
        self._number = 0
        self._last_in: dict[int, int] = {}
        self._previous: float | None = None
        self._periods: deque[float] = deque(maxlen=KEPT_PERIODS)
        self._gap = SHORTEST_GAP

    @property
    def gap(self) -> float:
        """The time [s] between two messages by which they are of different frames."""
        if math.isnan(self._gap):
            self._gap = min(max(HALF * median(self._periods), SHORTEST_GAP), LONGEST_GAP)
        return self._gap

    def add(self, part: int, arrival: float) -> None:
        """Take in a part that came at `arrival` [s]."""
        self.add_all((part,), arrival)

    def add_all(self, parts: Iterable[int], arrival: float) -> None:
        """Take in parts that came at `arrival` [s]."""
        if not self.parts:
            self._began = arrival
        self.parts.update(parts)
        self.newest = arrival

    def overdue(self, now: float) -> bool:
        """Whether nothing has come for so long that the frame is over: rule (c)."""
        return bool(self.parts) and now - self.newest > self.gap

    @property
    def whole(self) -> bool:
        """Whether every part is there that one of the last frames had: rule (d)."""
        return bool(self._last_in) and self._last_in.keys() <= self.parts

    def end(self) -> None:
        """The frame is over; the next part begins another."""
        self._number += 1
        self._last_in.update(dict.fromkeys(self.parts, self._number))
        if len(self._last_in) > len(self.parts):
            oldest = self._number - REMEMBERED_FRAMES
            self._last_in = {part: last for part, last in self._last_in.items() if last > oldest}
        if self._previous is not None:
            self._periods.append(self._began - self._previous)
            known = len(self._periods) >= FEWEST_PERIODS
            self._gap = math.nan if known else SHORTEST_GAP  # found when it is asked for
        self._previous = self._began
        self.parts = set()

    def discard(self) -> None:
        """The parts are those of the last frame once more: no frame."""
        self.parts = set()

    def restart(self) -> None:
        """Another sender may follow: expect nothing of it."""
        self._last_in.clear()
        self._periods.clear()
        self._gap = SHORTEST_GAP
        self._previous = None
