"""Turns a whole character about the vertical, and puts it on the floor or keeps it above."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import multiply

Array = NDArray[np.float64]


def place_on_floor(points: Array, angle: float, about: Array, lift: float, out: Array) -> float:
    """Turn points (N, 3) [m] about the vertical, lift them, and write them to `out` (N, 3).

    The turn is that of `heading.turned`. No point may be below the floor, y = 0: the lowest point
    raises all points if necessary.

    Args:
        points: (N, 3) [m], N > 0.
        angle: [rad] about the vertical through `about`.
        about: (3,) [m].
        lift: [m] the least rise.
        out: (N, 3), not `points` itself.

    Returns:
        The rise [m].
    """
    rise = max(lift, -_turn_level(points, math.cos(angle), math.sin(angle), about, out))
    _raise(points, rise, out)
    return rise


def place_above_floor(
    points: Array, angle: float, about: Array, clearance: float, out: Array
) -> float:
    """Turn points like `place_on_floor`, and put the lowest one `clearance` [m] above the floor.

    Returns:
        The rise [m], which is negative for points that were higher.
    """
    rise = clearance - _turn_level(points, math.cos(angle), math.sin(angle), about, out)
    _raise(points, rise, out)
    return rise


@kernel
def _turn_level(points: Array, cosine: float, sine: float, about: Array, out: Array) -> float:
    """Write the turned x and z; return the lowest y."""
    lowest = np.inf
    for i in range(len(points)):
        x, z = points[i, 0] - about[0], points[i, 2] - about[2]
        out[i, 0] = about[0] + (cosine * x + sine * z)
        out[i, 2] = about[2] + (cosine * z - sine * x)
        lowest = min(lowest, points[i, 1])
    return lowest


@kernel
def _raise(points: Array, rise: float, out: Array) -> None:
    for i in range(len(points)):
        out[i, 1] = points[i, 1] + rise


def turned_rotations(rotations: Array, angle: float) -> Array:
    """Turn world rotations (K, 4), unit quaternions, about the vertical by `angle` [rad]."""
    out = np.empty_like(rotations)
    _turn_on(rotations, math.cos(0.5 * angle), math.sin(0.5 * angle), out)
    return out


@kernel
def _turn_on(rotations: Array, cosine: float, sine: float, out: Array) -> None:
    for k in range(len(rotations)):
        own = (rotations[k, 0], rotations[k, 1], rotations[k, 2], rotations[k, 3])
        whole = multiply((0.0, sine, 0.0, cosine), own)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = whole
