"""Unit quaternions (x, y, z, w) in NumPy arrays: rotate, multiply, invert.

`solvers.kernels.quaternion` has the same operations for single quaternions in compiled loops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def rotate(quaternions: Array, vectors: Array) -> Array:
    """Rotate vectors (..., 3) by unit quaternions (..., 4)."""
    axis, w = quaternions[..., :3], quaternions[..., 3:]
    twice = 2.0 * _cross(axis, vectors)
    turned: Array = vectors + w * twice + _cross(axis, twice)
    return turned


def multiply(p: Array, q: Array) -> Array:
    """Multiply quaternions (..., 4): the rotation q, then p."""
    product = np.empty(np.broadcast_shapes(p.shape, q.shape))
    pv, pw, qv, qw = p[..., :3], p[..., 3:], q[..., :3], q[..., 3:]
    product[..., :3] = pw * qv + qw * pv + _cross(pv, qv)
    product[..., 3] = pw[..., 0] * qw[..., 0] - (pv * qv).sum(axis=-1)
    return product


def conjugate(quaternions: Array) -> Array:
    """Invert the rotations of unit quaternions (..., 4)."""
    inverse: Array = quaternions * np.array([-1.0, -1.0, -1.0, 1.0])
    return inverse


def between(a: Array, b: Array) -> Array:
    """Return the smallest rotations (..., 4) from unit vectors a to b (..., 3)."""
    turn = np.concatenate([_cross(a, b), 1.0 + (a * b).sum(axis=-1, keepdims=True)], axis=-1)
    norm = np.linalg.norm(turn, axis=-1, keepdims=True)
    # Opposite vectors have no smallest rotation: half a turn about any axis across them.
    aside = np.where(np.abs(a[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    half = np.concatenate([_cross(a, aside), np.zeros_like(norm)], axis=-1)
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    smallest: Array = np.where(norm > 1e-9, turn / np.maximum(norm, 1e-9), half)
    return smallest


def _cross(a: Array, b: Array) -> Array:
    """Cross products (..., 3); np.cross takes five times as long for a few vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    out[..., 0] = ay * bz - az * by
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out


def followed_by(rotations: Array, turn: Array, *, known: NDArray[np.bool_]) -> Array:
    """Compose rotations with one that follows all of them.

    Args:
        rotations: (..., 4), of any positive length where known.
        turn: (3, 3) the rotation matrix that follows.
        known: (...) bool; the result is NaN where False.
    """
    out = np.full_like(rotations, np.nan)
    if known.any():
        out[known] = (Rotation.from_matrix(turn) * Rotation.from_quat(rotations[known])).as_quat()
    return out
