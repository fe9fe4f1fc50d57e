"""A T or A pose that is held: how a performer asks for calibration without a hand free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import Kind, Side
from devices.skeleton import Skeleton
from solvers.kernels.compiled import kernel
from solvers.signal.continuity import distance

Array = NDArray[np.float64]

HOLD = 1.0  # [s]
STILL = 0.3  # [m/s] that a hand may move meanwhile
STRAIGHT = 0.94  # of the arm's bones that lies between shoulder and hand
T_POSE = (-0.35, 0.35)  # sine of how far the arms point up
A_POSE = (-0.87, -0.42)
ALIKE = 0.35  # between the sines of both arms
SIDEWAYS = 0.8  # share of the level part of each arm that points to its own side
UPRIGHT = 0.9  # cosine of the back from the vertical


class CalibrationPose:
    """Watches one performer for a pose that is held.

    Args:
        skeleton: one without arms or a back never strikes the pose.
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
        self._told = False

    def watch(self, positions: Array, filled: NDArray[np.bool_], time: float) -> bool:
        """Whether the pose has just been held long enough; true once each time it is struck.

        Args:
            positions: (J, 3) [m], level.
            filled: (J,) which of them are guesses.
            time: [s].
        """
        if self._joints is None:
            return False
        points = positions[self._joints]
        hands, elapsed = self._hands, time - self._at
        self._hands, self._at = points[4:6], time
        moved = 0.0 if hands is None else float(np.abs(points[4:6] - hands).max())
        still = hands is not None and 0.0 <= elapsed < HOLD and moved <= STILL * elapsed
        if not still or filled[self._joints].any() or not _struck(points):
            self._since, self._told = float("nan"), False
            return False
        if np.isnan(self._since):
            self._since = time
        told, self._told = self._told, time - self._since >= HOLD
        return self._told and not told


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
