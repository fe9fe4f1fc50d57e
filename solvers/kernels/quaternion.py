"""Operations on unit quaternions (x, y, z, w) in kernels, as tuples that stay in registers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@kernel
def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation `b` followed by `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


@kernel
def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse rotation."""
    return (-q[0], -q[1], -q[2], q[3])


@kernel
def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return the vector `v`, rotated by `q`."""
    x, y, z, w = q
    tx = 2.0 * (y * v[2] - z * v[1])
    ty = 2.0 * (z * v[0] - x * v[2])
    tz = 2.0 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


@kernel
def normalized(q: Quaternion) -> Quaternion:
    """Return `q` scaled to unit length, or the identity if its length is zero."""
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if norm < 1e-300:
        return (0.0, 0.0, 0.0, 1.0)
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


@kernel
def between(a: Vector, b: Vector, axis: Vector) -> Quaternion:
    """Return the smallest rotation from unit vector `a` to `b`, about `axis` if they oppose."""
    w = 1.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if w > 1e-12:
        x = a[1] * b[2] - a[2] * b[1]
        y = a[2] * b[0] - a[0] * b[2]
        z = a[0] * b[1] - a[1] * b[0]
        return normalized((x, y, z, w))
    along = axis[0] * a[0] + axis[1] * a[1] + axis[2] * a[2]
    x, y, z = axis[0] - along * a[0], axis[1] - along * a[1], axis[2] - along * a[2]
    if x * x + y * y + z * z < 1e-12:  # the axis lies along the vector: take any other
        x, y, z = (0.0, -a[2], a[1]) if abs(a[0]) < 0.9 else (-a[2], 0.0, a[0])
    return normalized((x, y, z, 0.0))


@kernel
def power(q: Quaternion, t: float) -> Quaternion:
    """Return the share `t` of the rotation `q`, which is over 180 degrees where w < 0."""
    sine = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    if sine < 1e-12:
        return (0.0, 0.0, 0.0, 1.0)
    half = t * math.atan2(sine, q[3])
    scale = math.sin(half) / sine
    return (q[0] * scale, q[1] * scale, q[2] * scale, math.cos(half))


@kernel
def matrix(q: Quaternion) -> tuple[Vector, Vector, Vector]:
    """Return the rows of the rotation matrix of a unit quaternion."""
    x, y, z, w = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


@kernel
def quaternion(rotations: NDArray[np.float64], at: int) -> Quaternion:
    """Return row `at` of rotations (n, 4)."""
    return (rotations[at, 0], rotations[at, 1], rotations[at, 2], rotations[at, 3])


@kernel
def is_rotation(q: Quaternion) -> bool:
    """Whether a row is a rotation at all; zeros stand for an unknown one."""
    return q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2 > 0.5


@kernel
def from_axes(x: Vector, z: Vector) -> Quaternion:
    """Return the rotation that takes the axes x and z to these orthogonal unit vectors."""
    first = between((0.0, 0.0, 1.0), z, (1.0, 0.0, 0.0))
    sideways = rotate(first, (1.0, 0.0, 0.0))
    upward = rotate(first, (0.0, 1.0, 0.0))
    cosine = sideways[0] * x[0] + sideways[1] * x[1] + sideways[2] * x[2]
    sine = upward[0] * x[0] + upward[1] * x[1] + upward[2] * x[2]
    angle = 0.5 * math.atan2(sine, cosine)
    return normalized(multiply(first, (0.0, 0.0, math.sin(angle), math.cos(angle))))
