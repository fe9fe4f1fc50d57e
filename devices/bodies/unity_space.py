"""Conversion between the coordinates of Unity (VMC, VRChat, Rokoko) and ours.

Unity is left-handed with +Y up; a body that faces +Z has its left at -X. Ours is right-handed with
the left at +X, so x is reflected. A rotation axis is a pseudovector: under the reflection its
components across x change sign, so (x, y, z, w) becomes (x, -y, -z, w). Both maps are their own
inverse, so the same functions convert in both directions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]

_POSITION = np.array([-1.0, 1.0, 1.0])
_ROTATION = np.array([1.0, -1.0, -1.0, 1.0])


def across_unity(positions: ArrayLike) -> Array:
    """Convert positions (..., 3) from Unity's space to ours, or back."""
    reflected: Array = np.asarray(positions, dtype=np.float64) * _POSITION
    return reflected


def turn_across_unity(quaternions: ArrayLike) -> Array:
    """Convert rotations (..., 4) as (x, y, z, w) from Unity's space to ours, or back."""
    reflected: Array = np.asarray(quaternions, dtype=np.float64) * _ROTATION
    return reflected


def unity_euler(degrees: ArrayLike) -> Array:
    """Convert Unity's Euler angles (..., 3) [degrees] about x, y, z to (x, y, z, w), Unity's space.

    Unity rotates about z first, then x, then y, each about the fixed axes: R = Ry Rx Rz.
    """
    half = np.radians(np.asarray(degrees, dtype=np.float64)) / 2.0
    turns = np.zeros((3, *half.shape[:-1], 4))
    for axis in range(3):
        turns[axis, ..., axis] = np.sin(half[..., axis])
        turns[axis, ..., 3] = np.cos(half[..., axis])
    return multiply(turns[1], multiply(turns[0], turns[2]))
