"""Operations on vectors (x, y, z) in kernels, as tuples that stay in registers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import Vector

_SHORTEST = 1e-12


@kernel
def point(points: NDArray[np.float64], at: int) -> Vector:
    """Return row `at` of points (n, 3)."""
    return (points[at, 0], points[at, 1], points[at, 2])


@kernel
def plus(a: Vector, b: Vector) -> Vector:
    """Return the sum."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def minus(a: Vector, b: Vector) -> Vector:
    """Return the vector from `b` to `a`."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scaled(a: Vector, by: float) -> Vector:
    """Return the vector, `by` times as long."""
    return (by * a[0], by * a[1], by * a[2])


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def norm(a: Vector) -> float:
    """Return the length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@kernel
def unit(a: Vector, otherwise: Vector) -> Vector:
    """Return the unit vector, or `otherwise` if the length is nearly 0 or not a number."""
    size = norm(a)
    return scaled(a, 1.0 / size) if size > _SHORTEST else otherwise


@kernel
def across(a: Vector, axis: Vector) -> Vector:
    """Return the part of a vector that is perpendicular to the unit vector `axis`."""
    return minus(a, scaled(axis, dot(a, axis)))
