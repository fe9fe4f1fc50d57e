"""A T or A pose that is held: how a performer asks for calibration without a hand free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.anatomy import Kind, Side, first_of, label_joints
from devices.skeleton import Skeleton

Array = NDArray[np.float64]

HOLD = 1.0  # [s]
STILL = 0.3  # [m/s] that a hand may move meanwhile
STRAIGHT = 0.94  # of the arm's bones that lies between shoulder and hand
T_POSE = (-0.35, 0.35)  # sine of how far the arms point up
A_POSE = (-0.87, -0.42)
ALIKE = 0.35  # between the sines of both arms
SIDEWAYS = 0.8  # share of the level part of each arm that points to its own side
UPRIGHT = 0.9  # cosine of the back from the vertical


class HeldPose:
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


def _struck(points: Array) -> bool:
    """Whether shoulders, elbows, hands (left, right), hips and head (8, 3) make a T or an A."""
    shoulders, elbows, hands, (hips, head) = points.reshape(4, 2, 3)
    arms, back, across = hands - shoulders, head - hips, shoulders[0] - shoulders[1]
    reach = np.linalg.norm(arms, axis=1)
    bones = np.linalg.norm(elbows - shoulders, axis=1) + np.linalg.norm(hands - elbows, axis=1)
    height, width = float(np.linalg.norm(back)), float(np.hypot(across[0], across[2]))
    if min(float(reach.min()), height, width) <= 0.0 or (reach < STRAIGHT * bones).any():
        return False
    rise = arms[:, 1] / reach
    poses = [bool(((low <= rise) & (rise <= high)).all()) for low, high in (T_POSE, A_POSE)]
    side = (arms[:, [0, 2]] @ across[[0, 2]]) * [1.0, -1.0] / width
    level = np.maximum(np.hypot(arms[:, 0], arms[:, 2]), 1e-9)
    out = bool((side > SIDEWAYS * level).all())
    return any(poses) and out and abs(rise[0] - rise[1]) < ALIKE and back[1] > UPRIGHT * height
