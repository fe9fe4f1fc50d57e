"""Turns pelvis and chest slowly while the joints hardly show how they are turned.

A tracker that loses a body, as one that sits or bends away, draws its hips or shoulders together.
The turn that is read from them then leaps by a right angle while no joint moves by more than a hand
is wide. How well a turn is seen shows in the lengths that it is read from, compared with what they
usually are. Bones of motion capture keep theirs, so its turns pass unchanged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.body.joint_turns import about_vertical
from solvers.retarget.trunk_turns import UPRIGHT, TrunkJoints, levers, trunk_turns
from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]

SURE, LOST = 0.6, 0.25  # of its usual length: from here on a length shows all, or nothing
SECONDS = 0.3  # [s] in which a turn is followed that is not seen at all
LONGEST = 1.0  # [s] between two frames: after a longer gap all is new
_STEP = 0.02  # share of its length by which a usual length adapts each frame


@dataclass(frozen=True, slots=True, eq=False)
class SteadyTrunkState:
    """The memory of a `SteadyTrunk`.

    Attributes:
        turns: (3, 4) of pelvis, chest and head.
        heading: [rad] of the performer.
        usual: (2, 2) [m] the usual lengths.
        frames: how many were measured.
        time: [s] of the newest frame; NaN before the first.
    """

    turns: Array
    heading: float
    usual: Array
    frames: int
    time: float


class SteadyTrunk:
    """The turns of a performer's pelvis, chest and head, frame after frame.

    Args:
        of: the joints that show them.
    """

    def __init__(self, of: TrunkJoints) -> None:
        self._of = of
        self._usual = np.zeros((2, 2))
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._turns, self._heading, self._time = UPRIGHT, 0.0, math.nan
        self._frames = 0

    def snapshot(self) -> SteadyTrunkState:
        """Return what the next frame depends on."""
        return SteadyTrunkState(
            self._turns, self._heading, self._usual.copy(), self._frames, self._time
        )

    def restore(self, state: SteadyTrunkState) -> None:
        """Go back to a snapshot."""
        self._turns, self._heading, self._time = state.turns, state.heading, state.time
        self._usual[:], self._frames = state.usual, state.frames

    def turns(self, joints: Array, upright: Array, heading: float, time: float) -> Array:
        """Return the rotations (3, 4) of pelvis, chest and head from standing upright.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
            upright: (3, 4) as of `trunk_turns`.
            heading: [rad] the turn of the whole performer, which is taken out of `joints`.
            time: [s]. If it steps back or leaps ahead, or is NaN, the trunk turns at once.
        """
        dt, self._time = time - self._time, time
        seen = self._seen(levers(joints, self._of))
        shares = np.ones(2)
        if 0.0 <= dt <= LONGEST:
            shares -= (1.0 - seen) * math.exp(-dt / SECONDS)
        before = self._turns
        if shares.min() < 1.0:  # as it stood on the stage
            before = multiply(about_vertical(self._heading - heading), before)
        self._turns, self._heading = trunk_turns(joints, self._of, upright, before, shares), heading
        return self._turns.copy()

    def _seen(self, lengths: Array) -> Array:
        """How well (2,) pelvis and chest are seen, from 0 to 1; take in their lengths (2, 2)."""
        self._frames += 1
        if self._frames == 1:
            self._usual[:] = lengths
        most = max(_STEP, 1.0 / self._frames) * self._usual
        self._usual += np.clip(lengths - self._usual, -most, most)
        shares = lengths / np.maximum(self._usual, 1e-9)
        seen: Array = np.clip((shares.min(axis=1) - LOST) / (SURE - LOST), 0.0, 1.0)
        return np.where(self._usual.min(axis=1) > 0.0, seen, 1.0)
