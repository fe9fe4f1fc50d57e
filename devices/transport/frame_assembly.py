"""Assembles messages to frames in protocols that do not mark frames (VMC, VRChat, NI mate)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from statistics import median

HALF = 0.5  # periods of silence that end a frame
# [s] bounds of that silence. Queued messages come faster than they were sent, and say nothing about
# the period; above 125 Hz, frames end because a part repeats.
SHORTEST_GAP, LONGEST_GAP = 0.004, 0.25
FEWEST_PERIODS, KEPT_PERIODS = 2, 9
REMEMBERED_FRAMES = 30  # a part that is missing in this many frames is no longer expected


class FrameAssembly:
    """Decides when the received parts make a frame.

    A frame ends (a) when a time or status message follows parts, (b) when a part repeats, (c) after
    half a period of silence, as in the protocol's receivers; and, so that a complete frame need not
    wait for the next one, (d) at the end of the datagram that completes the set of recent parts.

    Attributes:
        parts: the parts of the frame being assembled.
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
        """Silence [s] between two messages after which they belong to different frames."""
        if math.isnan(self._gap):
            self._gap = min(max(HALF * median(self._periods), SHORTEST_GAP), LONGEST_GAP)
        return self._gap

    def add(self, part: int, arrival: float) -> None:
        """Add a part received at `arrival` [s]."""
        self.add_all((part,), arrival)

    def add_all(self, parts: Iterable[int], arrival: float) -> None:
        """Add parts received at `arrival` [s]."""
        if not self.parts:
            self._began = arrival
        self.parts.update(parts)
        self.newest = arrival

    def overdue(self, now: float) -> bool:
        """Whether the silence until `now` [s] has ended the frame: rule (c)."""
        return bool(self.parts) and now - self.newest > self.gap

    @property
    def whole(self) -> bool:
        """Whether every part that a recent frame had is present: rule (d)."""
        return bool(self._last_in) and self._last_in.keys() <= self.parts

    def end(self) -> None:
        """End the frame; the next part begins another."""
        self._number += 1
        self._last_in.update(dict.fromkeys(self.parts, self._number))
        if len(self._last_in) > len(self.parts):
            oldest = self._number - REMEMBERED_FRAMES
            self._last_in = {part: last for part, last in self._last_in.items() if last > oldest}
        if self._previous is not None:
            self._periods.append(self._began - self._previous)
            known = len(self._periods) >= FEWEST_PERIODS
            self._gap = math.nan if known else SHORTEST_GAP  # computed when it is needed
        self._previous = self._began
        self.parts = set()

    def discard(self) -> None:
        """Discard the parts, which repeat the last frame."""
        self.parts = set()

    def restart(self) -> None:
        """Expect nothing of the next sender, which may be another one."""
        self._last_in.clear()
        self._periods.clear()
        self._gap = SHORTEST_GAP
        self._previous = None
