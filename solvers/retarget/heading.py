"""Which way a performer faces, so that a turn of the whole body is told from a move of a limb.

AniMesh measures a limb's turns against the capture device. A performer who turns round would then
swing both arms through the character's body; so the heading is taken out of the pose before the
limbs are retargeted, and given to the character as a whole where all of it is driven.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]

LEVEL = 0.3  # least horizontal share of the left-right axis for a heading to be read from it


def heading(positions: Array, pairs: NDArray[np.int64], before: float = 0.0) -> float:
    """Angle about +Y by which a body has turned from facing +Z.

    Args:
        positions: (J, 3) [m], +Y up.
        pairs: (P, 2) indices of left and right joints of hips and shoulders; a body that faces +Z
            has its left at +X.
        before: the heading one frame earlier [rad]; the answer is the nearest to it among those
            that differ by whole turns, and `before` itself when the body lies on its side.

    Returns:
        The heading [rad], 0 facing +Z, positive to the body's left.
    """
    x, y, z = _across(positions, pairs)
    level = math.hypot(x, z)
    if level <= LEVEL * math.hypot(level, y) or level == 0.0:
        return before
    angle = math.atan2(-z, x)
    return before + (angle - before + math.pi) % (2.0 * math.pi) - math.pi


@kernel
def _across(positions: Array, pairs: NDArray[np.int64]) -> tuple[float, float, float]:
    """From the right joints to the left ones, summed."""
    x = y = z = 0.0
    for left, right in pairs:
        x += positions[left, 0] - positions[right, 0]
        y += positions[left, 1] - positions[right, 1]
        z += positions[left, 2] - positions[right, 2]
    return x, y, z


def turned(positions: Array, angle: float, about: Array) -> Array:
    """Positions (n, 3) turned by `angle` [rad] about the vertical through `about` (3,)."""
    out = np.empty(positions.shape)
    _turn(np.ascontiguousarray(positions), math.cos(angle), math.sin(angle), about, out)
    return out


@kernel
def _turn(points: Array, cosine: float, sine: float, about: Array, out: Array) -> None:
    for i in range(len(points)):
        x, z = points[i, 0] - about[0], points[i, 2] - about[2]
        out[i, 0] = about[0] + (cosine * x + sine * z)
        out[i, 1] = points[i, 1]
        out[i, 2] = about[2] + (cosine * z - sine * x)
