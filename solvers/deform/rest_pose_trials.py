"""Decides when a solver also tries to start from the rest pose, moved along with the handles.

After a jump the last answer may be a bad start. Small steps add up as well: a slow full turn leaves
a twist behind. So the rest pose is tried after a jump and, while the handles move, every few
frames. It replaces the last answer only where its energy is lower by a margin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

# A group of handles that turned or went further than this between two frames has jumped: radians,
# and shares of the character's size.
_JUMP_ANGLE = math.radians(30.0)
_JUMP_PATH = 0.1

# While the handles move, the rest pose is tried every so many frames: between two frames where
# `settle` is called. A group that turned or went less than this (radians, sizes) stood still.
_INTERVAL = 8
_STILL = 1e-4

# The rest pose must have less than this share of the last answer's energy: after a jump, and during
# a smooth motion, where the change must not be seen.
_BETTER, _MUCH_BETTER = 0.9, 0.5


@dataclass(frozen=True, slots=True)
class RestPoseTrials:
    """The state that decides whether the rest pose is tried.

    Attributes:
        frames_since: the frames since the last trial.
        has_moved: whether a handle has moved since then.
        is_fresh: whether no solve has come since the rest pose, so that a trial is needless.
    """

    frames_since: int = 0
    has_moved: bool = False
    is_fresh: bool = True

    def after_step(self, angle: float, path: float) -> RestPoseTrials:
        """Return the state after groups turned by at most `angle` [rad] and went `path` [sizes]."""
        moved = self.has_moved or angle > _STILL or path > _STILL
        return replace(self, frames_since=self.frames_since + 1, has_moved=bool(moved))

    def share_after_step(self, angle: float, path: float) -> float | None:
        """Return the share of the energy that a trial in this frame must beat, None for no trial.

        `angle` and `path` are those of `after_step`, which comes first.
        """
        if angle > _JUMP_ANGLE or path > _JUMP_PATH:
            return _BETTER
        if self.has_moved and self.frames_since > _INTERVAL:
            return _MUCH_BETTER
        return None

    def share_between_frames(self) -> float | None:
        """Return the same for a trial between two frames."""
        return _MUCH_BETTER if self.has_moved and self.frames_since >= _INTERVAL else None

    def after_trial(self) -> RestPoseTrials:
        """Return the state after a trial."""
        return replace(self, frames_since=0, has_moved=False)

    def after_solve(self) -> RestPoseTrials:
        """Return the state after a solve."""
        return replace(self, is_fresh=False) if self.is_fresh else self
