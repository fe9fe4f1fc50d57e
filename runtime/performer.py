"""A performer as the characters see one: whole, facing the stage, moving from a rest state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.anatomy import available_presets, heading_joints, source_joints, source_tree
from devices.skeleton import Skeleton, SkeletonFrame
from replay.fill import FilledFrame, Filler
from solvers.heading import heading, turned
from solvers.tree import Tree

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """What a performer does at one moment.

    Attributes:
        positions: (J, 3) [m] every joint, with the turn of the whole body since the rest state
            taken out; never NaN.
        seen: (J, 3) [m] every joint where the performer really is; never NaN.
        filled: (J,) bool, joints that were not seen but filled in.
        turn: [rad] about +Y, the turn that was taken out.
        lift: [m] how much higher the root is than in the rest state.
    """

    positions: Array
    seen: Array
    filled: NDArray[np.bool_]
    turn: float
    lift: float


class Performer:
    """Follows one performer from frame to frame.

    Attributes:
        skeleton: the performer's whole skeleton.
        joints: the joints that may drive a character, as chosen by `source`.
        legs: the joints of each leg, empty for a performer without any.

    Raises:
        InputError: `source` names a part or joints that this skeleton does not have.
    """

    def __init__(self, skeleton: Skeleton, source: str = "whole") -> None:
        self.skeleton = skeleton
        self._parents, self.joints = source_tree(skeleton, source_joints(skeleton, source))
        there = available_presets(skeleton)
        self.legs = [
            frozenset(source_joints(skeleton, leg))
            for leg in ("left-leg", "right-leg")
            if leg in there
        ]
        self._pairs = np.array(heading_joints(skeleton), dtype=np.int64).reshape(-1, 2)
        self._filler = Filler(skeleton)
        self._heading = 0.0
        self._rest_heading = 0.0
        self._rest_height = 0.0
        self._filled: FilledFrame | None = None

    def follow(self, frame: SkeletonFrame) -> None:
        """Take in one frame."""
        self._filled = self._filler.fill(frame)
        self._heading = heading(self._filled.positions, self._pairs, self._heading)

    @property
    def pose(self) -> Pose | None:
        """The newest pose as seen from the rest state; None before the first frame."""
        if self._filled is None:
            return None
        positions = self._filled.positions
        turn = self._heading - self._rest_heading
        root = positions[self.skeleton.root]
        return Pose(
            positions=turned(positions, -turn, root),
            seen=positions,
            filled=self._filled.filled,
            turn=turn,
            lift=float(root[1]) - self._rest_height,
        )

    def rest(self) -> Array:
        """Make the newest pose the rest state and return its positions (J, 3) [m]."""
        if self._filled is None:
            raise RuntimeError("no frame has been followed yet")
        self._rest_heading = self._heading
        self._rest_height = float(self._filled.positions[self.skeleton.root, 1])
        return self._filled.positions

    def rest_tree(self) -> Tree:
        """The chosen joints as a tree, standing as the skeleton does at rest."""
        return Tree(self._parents, self.skeleton.rest_positions[self.joints])
