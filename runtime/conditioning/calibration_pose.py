"""Recognises a T or A pose kept still, by which a performer asks for calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import Kind, Side
from devices.skeleton import Skeleton
from solvers.kernels.compiled import kernel
from solvers.signal.continuity import distance

Array = NDArray[np.float64]

KEPT_STILL = 1.0  # [s] that the pose must be kept
STILL = 0.3  # [m/s] that a hand may move meanwhile
STRAIGHT = 0.94  # least distance from shoulder to hand, as a share of the arm's bones
T_POSE = (-0.35, 0.35)  # sine of the angle of the arms above the horizontal
A_POSE = (-0.87, -0.42)
ALIKE = 0.35  # largest difference between the sines of both arms
SIDEWAYS = 0.8  # least share of the horizontal part of each arm that points to its own side
UPRIGHT = 0.9  # least cosine between the back and the vertical


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationPoseState:
    """What was seen of one performer's pose.

    Attributes:
        hands: (2, 3) [m] both hands in the last frame; None before the first.
        at: [s] the last frame's time.
        since: [s] when the pose was struck; NaN while it is not.
        reported: whether this pose has been reported.
    """

    hands: Array | None
    at: float
    since: float
    reported: bool


class CalibrationPose:
    """Watches one performer for a calibration pose.

    Args:
        skeleton: without arms or a back, the pose is never recognised.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        parts = label_joints(skeleton)
        arms = [
            [first_of(parts, skeleton, kind, side) for side in (Side.LEFT, Side.RIGHT)]
            for kind in (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
        ]
        back = [first_of(parts, skeleton, kind) for kind in (Kind.HIPS, Kind.HEAD)]
        found = [joint for joint in (*arms[0], *arms[1], *arms[2], *back) if joint is not None]
        self._joints = np.array(found) if len(found) == 8 else None
        self._hands: Array | None = None
        self._at = 0.0
        self._since = float("nan")
        self._reported = False

    def snapshot(self) -> CalibrationPoseState:
        """Return what was seen so far."""
        hands = None if self._hands is None else self._hands.copy()
        return CalibrationPoseState(hands, self._at, self._since, self._reported)

    def restore(self, state: CalibrationPoseState) -> None:
        """Go back to a snapshot."""
        self._hands = None if state.hands is None else state.hands.copy()
        self._at, self._since, self._reported = state.at, state.since, state.reported

    def watch(self, positions: Array, filled: NDArray[np.bool_], time: float) -> bool:
        """Return whether the pose has now been kept for long enough; true once for each pose.

        Args:
            positions: (J, 3) [m], on a level floor.
            filled: (J,) which of them are guesses.
            time: [s].
        """
        if self._joints is None:
            return False
        points = positions[self._joints]
        hands, elapsed = self._hands, time - self._at
        self._hands, self._at = points[4:6], time
        moved = 0.0 if hands is None else float(np.abs(points[4:6] - hands).max())
        still = hands is not None and 0.0 <= elapsed < KEPT_STILL and moved <= STILL * elapsed
        if not still or filled[self._joints].any() or not _struck(points):
            self._since, self._reported = float("nan"), False
            return False
        if np.isnan(self._since):
            self._since = time
        reported, self._reported = self._reported, time - self._since >= KEPT_STILL
        return self._reported and not reported


@kernel
def _struck(points: Array) -> bool:
    """Whether shoulders, elbows, hands (left, right), hips and head (8, 3) make a T or an A."""
    left, right, hips, head = points[0], points[1], points[6], points[7]
    across_x, across_z = left[0] - right[0], left[2] - right[2]
    width = np.hypot(across_x, across_z)
    if width <= 0.0 or head[1] - hips[1] <= UPRIGHT * distance(hips, head):
        return False
    rise = np.zeros(2)
    for side in range(2):
        shoulder, elbow, hand = points[side], points[2 + side], points[4 + side]
        reach = distance(shoulder, hand)
        bones = distance(shoulder, elbow) + distance(elbow, hand)
        if reach <= 0.0 or reach < STRAIGHT * bones:
            return False
        x, y, z = hand - shoulder
        outward = (x * across_x + z * across_z) / width
        level = max(np.hypot(x, z), 1e-9)
        if (outward if side == 0 else -outward) <= SIDEWAYS * level:
            return False
        rise[side] = y / reach
    low, high = rise.min(), rise.max()
    t_pose = T_POSE[0] <= low and high <= T_POSE[1]
    a_pose = A_POSE[0] <= low and high <= A_POSE[1]
    return bool((t_pose or a_pose) and high - low < ALIKE)
