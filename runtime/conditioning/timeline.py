"""Time that only goes forward, whatever packets and clocks do.

What comes twice or late is dropped. A clock that jumps, because the sender was started again or set
back, is told by the size of the jump, or by its going on from there; the show's time then goes on
from where it was.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from devices.skeleton import SkeletonFrame

JUMP = 0.5  # [s] by which no network delays a packet, so that it was the clock
INSISTENCE = 3  # frames in order, each later than the show has come, that are no stragglers
LEAST_STEP = 1e-3  # [s] by which the show's time goes on after a jump
MOST_PERFORMERS = 64


@dataclass(slots=True)
class _Newest:
    """One performer's newest frame, and what came after it with earlier times."""

    frame: SkeletonFrame
    straggler: float = -math.inf
    stragglers: int = 0


class Timeline:
    """Admits the frames of a stream in order, on a clock of its own that never falls.

    Attributes:
        late: frames dropped so far because a newer one had come.
        duplicates: frames dropped so far because they had come before.
        jumps: how often the clock jumped.
    """

    def __init__(self) -> None:
        self.late = 0
        self.duplicates = 0
        self.jumps = 0
        self._newest: dict[int, _Newest] = {}
        self._last: SkeletonFrame | None = None
        self._shift = 0.0
        self._begin = -math.inf  # of the sender's clock since it jumped

    def admit(self, frame: SkeletonFrame) -> SkeletonFrame | None:
        """The frame on the show's clock, or None where it is to be dropped."""
        if not math.isfinite(frame.time):
            self.late += 1
            return None
        self._follow_jumps(frame)
        if frame.time < self._begin:  # others' frames from before the jump
            self.late += 1
            return None
        before = self._newest.get(frame.performer)
        if before is not None and frame.time <= before.frame.time:
            if frame.time == before.frame.time and _alike(frame, before.frame):
                self.duplicates += 1
                return None
            if frame.time < before.frame.time and not self._insists(before, frame):
                self.late += 1
                return None
        self._newest.pop(frame.performer, None)
        self._newest[frame.performer] = _Newest(frame)
        if len(self._newest) > MOST_PERFORMERS:
            del self._newest[next(iter(self._newest))]
        if self._last is None or frame.time > self._last.time:
            self._last = frame
        return frame if self._shift == 0.0 else replace(frame, time=frame.time + self._shift)

    def _follow_jumps(self, frame: SkeletonFrame) -> None:
        """Shift the clock where the sender's has jumped, back or ahead."""
        if self._last is None:
            return
        step = frame.time - self._last.time
        passed = frame.arrival - self._last.arrival  # NaN where nobody knows
        if step < -JUMP or (step > JUMP and step - passed > JUMP):
            self._jump(frame, passed)

    def _insists(self, before: _Newest, frame: SkeletonFrame) -> bool:
        """Whether a clock goes on from an earlier time, and so was set back by a little."""
        rises = frame.time > before.straggler
        before.stragglers = before.stragglers + 1 if rises else 1
        before.straggler = frame.time
        if before.stragglers < INSISTENCE:
            return False
        self._jump(frame, float("nan"))
        return True

    def _jump(self, frame: SkeletonFrame, passed: float) -> None:
        assert self._last is not None
        go_on = max(passed, LEAST_STEP) if math.isfinite(passed) else LEAST_STEP
        self._shift += self._last.time + go_on - frame.time
        self._newest.clear()
        self._last, self._begin = frame, frame.time
        self.jumps += 1


def _alike(a: SkeletonFrame, b: SkeletonFrame) -> bool:
    return np.array_equal(a.positions, b.positions, equal_nan=True)
