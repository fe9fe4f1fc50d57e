"""From local poses along a skeleton to world poses, all joints at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def rotate(quaternions: Array, vectors: Array) -> Array:
    """Vectors (..., 3) turned by unit quaternions (..., 4) in (x, y, z, w)."""
    axis, w = quaternions[..., :3], quaternions[..., 3:]
    twice = 2.0 * _cross(axis, vectors)
    turned: Array = vectors + w * twice + _cross(axis, twice)
    return turned


def multiply(p: Array, q: Array) -> Array:
    """Products of quaternions (..., 4) in (x, y, z, w): the rotation q, then p."""
    product = np.empty(np.broadcast_shapes(p.shape, q.shape))
    pv, pw, qv, qw = p[..., :3], p[..., 3:], q[..., :3], q[..., 3:]
    product[..., :3] = pw * qv + qw * pv + _cross(pv, qv)
    product[..., 3] = pw[..., 0] * qw[..., 0] - (pv * qv).sum(axis=-1)
    return product


def conjugate(quaternions: Array) -> Array:
    """The inverse rotations of unit quaternions (..., 4) in (x, y, z, w)."""
    inverse: Array = quaternions * np.array([-1.0, -1.0, -1.0, 1.0])
    return inverse


def _cross(a: Array, b: Array) -> Array:
    """Cross products (..., 3); np.cross takes five times as long for a few vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    out[..., 0] = ay * bz - az * by
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out


class ForwardKinematics:
    """World poses of the joints of one tree, or of several.

    Each round composes every joint's transform with that of the ancestor it is relative to, and
    makes it relative to that one's ancestor: log2(depth) rounds over whole arrays instead of one
    step for each level (pointer jumping; Hillis and Steele 1986, "Data parallel algorithms").

    Args:
        parents: (J,) int; the joint that each one's local pose is relative to, -1 for the world.

    Raises:
        ValueError: a parent is out of range, or there is a cycle.
    """

    def __init__(self, parents: ArrayLike) -> None:
        above = np.array(parents, dtype=np.int64)
        count = len(above)
        if above.ndim != 1 or (above < -1).any() or (above >= count).any():
            raise ValueError(f"Expected `parents` (J,) from -1 to J - 1, got {above}")
        # One joint more stands for the world; it is its own parent, and its pose the identity.
        above = np.append(np.where(above < 0, count, above), count)
        self._rounds: list[NDArray[np.int64]] = []
        while (above < count).any():
            if 2 ** len(self._rounds) > count:
                raise ValueError("Expected `parents` to form trees, got a cycle")
            self._rounds.append(above)
            above = above[above]
        self._count = count

    def world(self, offsets: Array, rotations: Array) -> tuple[Array, Array]:
        """Positions (..., J, 3) and rotations (..., J, 4) in the world.

        Args:
            offsets: (..., J, 3) [m] of each joint from its parent, in the parent's axes.
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
