"""World poses of joints from their local poses, for all joints of a tree at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.skeleton.quaternions import multiply, rotate

Array = NDArray[np.float64]


class ForwardKinematics:
    """World poses of the joints of one or several trees.

    Each round composes every joint's transform with that of the ancestor that it is relative to,
    and makes it relative to that ancestor's ancestor: log2(depth) rounds over whole arrays instead
    of one step per level (pointer jumping; Hillis and Steele 1986, "Data parallel algorithms").

    Args:
        parents: (J,) int; the joint to which each local pose is relative, -1 for the world.

    Raises:
        ValueError: a parent is out of range, or there is a cycle.
    """

    def __init__(self, parents: ArrayLike) -> None:
        above = np.array(parents, dtype=np.int64)
        count = len(above)
        if above.ndim != 1 or (above < -1).any() or (above >= count).any():
            raise ValueError(f"Expected `parents` (J,) from -1 to J - 1, got {above}")
        # An additional joint is the world: its own parent, with the identity as its pose.
        above = np.append(np.where(above < 0, count, above), count)
        self._rounds: list[NDArray[np.int64]] = []
        while (above < count).any():
            if 2 ** len(self._rounds) > count:
                raise ValueError("Expected `parents` to form trees, got a cycle")
            self._rounds.append(above)
            above = above[above]
        self._count = count

    def world(self, offsets: Array, rotations: Array) -> tuple[Array, Array]:
        """Return positions (..., J, 3) and rotations (..., J, 4) in the world.

        Args:
            offsets: (..., J, 3) of each joint from its parent, in the parent's axes.
            rotations: (..., J, 4) unit quaternions (x, y, z, w), joint to parent.
        """
        positions = np.zeros((*offsets.shape[:-2], self._count + 1, 3))
        turns = np.zeros((*rotations.shape[:-2], self._count + 1, 4))
        turns[..., -1, 3] = 1.0
        positions[..., :-1, :], turns[..., :-1, :] = offsets, rotations
        for above in self._rounds:
            upper = turns[..., above, :]
            positions = positions[..., above, :] + rotate(upper, positions)
            turns = multiply(upper, turns)
        return positions[..., :-1, :], turns[..., :-1, :]
