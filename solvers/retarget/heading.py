"""The direction that a performer faces: it separates turns of the body from motions of limbs.

AniMesh measures the turns of a limb against the capture device. A performer who turns round would
then swing both arms through the character's body. So the heading is removed from the pose before
the limbs are retargeted, and turns the whole character where all of it is driven.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]

LEVEL = 0.3  # least horizontal share of the left-right axis that gives a heading


def heading(positions: Array, pairs: NDArray[np.int64], before: float = 0.0) -> float:
    """Return the angle about +Y by which a body has turned from facing +Z.

    Args:
        positions: (J, 3) [m], +Y up.
        pairs: (P, 2) indices of left and right joints of hips and shoulders; a body that faces +Z
            has its left at +X.
        before: [rad] the heading one frame earlier. Of the angles that differ by whole turns, the
            answer is the nearest to it; it is `before` itself when the body lies on its side.

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
    """The sum of the vectors from right joints to left joints."""
    x = y = z = 0.0
    for left, right in pairs:
        x += positions[left, 0] - positions[right, 0]
        y += positions[left, 1] - positions[right, 1]
        z += positions[left, 2] - positions[right, 2]
    return x, y, z


def turned(positions: Array, angle: float, about: Array) -> Array:
    """Return positions (n, 3) turned by `angle` [rad] about the vertical through `about` (3,)."""
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
