"""Tells exact joints from measured ones: the rotations of exact joints carry all bones rigidly.

Animations, motion capture on a skeleton and suits turn rigid bones, and joints lie where these end.
Where a sensor gives rotations at all, bones change their lengths by its noise from frame to frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import conjugate, is_rotation, quaternion, rotate
from solvers.kernels.short_loops import put
from solvers.kernels.vector import minus, norm, point

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

RIGID = 1e-3  # of its length: how far the end of a rigid bone may be off
ROUNDING = 1e-5  # [m] how far it may be off besides
MOST = 0.75  # share of the bones that are rigid where joints are exact; some slide on purpose


@dataclass(frozen=True, slots=True, eq=False)
class ExactJointsState:
    """The memory of an `ExactJoints`: (J, 3) bones, (J, 3) the last places, and the verdict."""

    bones: Array
    places: Array
    exact: bool


class ExactJoints:
    """Watches whether one performer's joints are exact.

    Args:
        skeleton: of all frames.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self._parents = skeleton.parents
        self._bones = np.full((len(skeleton.names), 3), np.nan)
        self._places = self._bones.copy()
        self._exact = False

    def snapshot(self) -> ExactJointsState:
        """Return a copy of the memory."""
        return ExactJointsState(self._bones.copy(), self._places.copy(), self._exact)

    def restore(self, state: ExactJointsState) -> None:
        """Go back to a snapshot."""
        self._bones[:], self._places[:] = state.bones, state.places
        self._exact = state.exact

    def watch(self, positions: Array, rotations: Array | None) -> bool:
        """Return whether this frame's joints are exact.

        A frame that repeats the one before tells nothing new. Joints are not exact before the
        second pose.

        Args:
            positions: (J, 3) [m]; NaN where not seen.
            rotations: (J, 4) joint to world, NaN where unknown; None without any.
        """
        if rotations is None:
            self._exact = False
        elif not np.array_equal(positions, self._places, equal_nan=True):
            self._exact = _carried(self._parents, positions, rotations, self._bones)
            self._places[:] = positions
        return self._exact


@kernel
def _carried(parents: Ints, positions: Array, rotations: Array, bones: Array) -> bool:
    """Return whether most bones are where they were in the frames of their joints.

    Args:
        parents: (J,) -1 for the root.
        positions: (J, 3) [m].
        rotations: (J, 4).
        bones: (J, 3) [m] each bone in the frame of its beginning, NaN where unknown; if most have
            changed, all are overwritten.
    """
    own = np.full_like(bones, np.nan)
    known, rigid = 0, 0
    for joint in range(len(parents)):
        parent = parents[joint]
        if parent < 0 or np.isnan(positions[joint, 0]) or np.isnan(positions[parent, 0]):
            continue
        turn = quaternion(rotations, parent)
        if not is_rotation(turn):
            continue
        bone = rotate(conjugate(turn), minus(point(positions, joint), point(positions, parent)))
        for axis in range(3):
            own[joint, axis] = bone[axis]
        if np.isnan(bones[joint, 0]):
            continue
        known += 1
        off = norm(minus(bone, point(bones, joint)))
        rigid += off <= RIGID * norm(bone) + ROUNDING
    if known > 0 and rigid >= MOST * known:
        return True
    for joint in range(len(parents)):
        put(bones[joint], own[joint])
    return False
