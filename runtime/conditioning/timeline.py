"""Gives frames times that only increase, whatever packets and clocks do.

Duplicate and late frames are dropped. A sender's clock jumps when the sender is started again or
its clock is set. A jump is recognised by its size, or because frames go on from the new time; the
show's time then goes on from its last value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from devices.skeleton import SkeletonFrame

JUMP = 0.5  # [s] more than any delay in a network: the clock has jumped
INSISTENCE = 3  # late frames in rising order after which the clock was set back
LEAST_STEP = 1e-3  # [s] by which the show's time rises at a jump
MOST_PERFORMERS = 64


@dataclass(frozen=True, slots=True)
class _Newest:
    """One performer's newest frame, and the late frames since.

    Attributes:
        frame: the newest frame.
        straggler: [s] time of the last late frame.
        stragglers: late frames in rising order.
    """

    frame: SkeletonFrame
    straggler: float = -math.inf
    stragglers: int = 0


@dataclass(frozen=True, slots=True)
class TimelineState:
    """A timeline between two frames.

    Attributes:
        late, duplicates, jumps: the counts of a `Timeline`.
        newest: (performer, newest frame) of each performer, the longest unseen first.
        last: the frame with the highest time of the sender's clock.
        shift: [s] from the sender's clock to the show's.
        begin: [s] of the sender's clock after its last jump.
    """

    late: int
    duplicates: int
    jumps: int
    newest: tuple[tuple[int, _Newest], ...]
    last: SkeletonFrame | None
    shift: float
    begin: float


class Timeline:
    """Admits the frames of a stream in order, on a clock of its own that never runs back.

    Attributes:
        late: frames dropped so far because a newer one had come.
        duplicates: frames dropped so far because they had come before.
        jumps: jumps of the sender's clock so far.
    """

    def __init__(self) -> None:
        self.late = 0
        self.duplicates = 0
        self.jumps = 0
        self._newest: dict[int, _Newest] = {}
        self._last: SkeletonFrame | None = None
        self._shift = 0.0
        self._begin = -math.inf  # of the sender's clock since it jumped

    def snapshot(self) -> TimelineState:
        """Return the clock and the newest frames; frames are immutable and shared."""
        return TimelineState(
            self.late,
            self.duplicates,
            self.jumps,
            tuple(self._newest.items()),
            self._last,
            self._shift,
            self._begin,
        )

    def restore(self, state: TimelineState) -> None:
        """Go back to a snapshot."""
        self.late, self.duplicates, self.jumps = state.late, state.duplicates, state.jumps
        self._newest, self._last = dict(state.newest), state.last
        self._shift, self._begin = state.shift, state.begin

    def admit(self, frame: SkeletonFrame) -> SkeletonFrame | None:
        """Return the frame on the show's clock; None for a frame to drop."""
        if not math.isfinite(frame.time):
            self.late += 1
            return None
        self._follow_jumps(frame)
        if frame.time < self._begin:  # a frame of another performer from before the jump
            self.late += 1
            return None
        before = self._newest.get(frame.performer)
        if before is not None and frame.time <= before.frame.time:
            if frame.time == before.frame.time and _alike(frame, before.frame):
                self.duplicates += 1
                return None
            if frame.time < before.frame.time and not self._is_set_back(before, frame):
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
        """Shift the show's clock where the sender's has jumped, back or ahead."""
        if self._last is None:
            return
        step = frame.time - self._last.time
        passed = frame.arrival - self._last.arrival  # NaN where arrivals are not known
        if step < -JUMP or (step > JUMP and step - passed > JUMP):
            self._jump(frame, passed)

    def _is_set_back(self, before: _Newest, frame: SkeletonFrame) -> bool:
        """Return whether a clock goes on from an earlier time, and so was set back by a little."""
        rises = frame.time > before.straggler
        stragglers = before.stragglers + 1 if rises else 1
        late = _Newest(before.frame, frame.time, stragglers)
        self._newest[frame.performer] = late
        if stragglers < INSISTENCE:
            return False
        self._jump(frame, float("nan"))
        return True

    def _jump(self, frame: SkeletonFrame, passed: float) -> None:
        """Let the show's time go on by `passed` [s], NaN where that is not known, at this frame."""
        assert self._last is not None
        go_on = max(passed, LEAST_STEP) if math.isfinite(passed) else LEAST_STEP
        self._shift += self._last.time + go_on - frame.time
        self._newest.clear()
        self._last, self._begin = frame, frame.time
        self.jumps += 1


def _alike(a: SkeletonFrame, b: SkeletonFrame) -> bool:
    return np.array_equal(a.positions, b.positions, equal_nan=True)
