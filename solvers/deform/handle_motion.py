"""Moves a surface along with its handles, as a start for the solver's iterations.

The handles around one skeleton node form a group and move rigidly. The motion of each group between
two sets of handle positions is fitted (Kabsch 1976). Every vertex follows a smooth blend of the
motions of its groups as dual quaternions (Kavan et al. 2007, Skinning with dual quaternions,
section 3): equal motions blend to exactly that motion, and half turns do not collapse. From this
start the solver has only the bending left to find.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import prange
from numpy.typing import NDArray

from solvers.deform.rotation_fit import LANES, SCRATCH, fit_rotations
from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.kernels.quaternion import Quaternion, Vector
from solvers.kernels.short_loops import put
from solvers.linear.laplacian import Floats, Ints

KEPT = 4  # groups that move a vertex
_COLLINEAR = 1e-6  # second over first extent of points that count as a line
_PRIOR = 1e-6  # weight of the rotation of all handles where a group's own is ambiguous


@dataclass(frozen=True, slots=True)
class Influences:
    """The groups (N, KEPT) that each vertex follows, and weights (N, KEPT) whose rows sum to 1."""

    groups: NDArray[np.uint32]
    weights: Floats


def fit_motions(source: Floats, target: Floats, group_of: Ints, count: int) -> Floats:
    """Fit the rigid motions of `count` groups as dual quaternions (G, 8), scalars first.

    Each motion takes the group's points of `source` (H, 3) as near as possible to those of `target`
    (H, 3); `group_of` (H,) is the group of each point, -1 for none. A group may leave its motion
    ambiguous: a point has no rotation, a line has none about itself, an empty group has no motion.
    The motion of all points together then decides, and after that the smallest rotation.

    Source: Kabsch 1976; Horn 1987.
    """
    return _fit_motions(source, target, group_of, count)


@kernel
def _fit_motions(source: Floats, target: Floats, group_of: Ints, count: int) -> Floats:
    together = np.zeros_like(group_of)
    covariance, centre = _covariances(source, target, together, np.zeros((1, 6)))
    overall = _rotations(covariance, np.eye(3).ravel())[0]
    empty = np.empty((count, 6))
    for g in range(count):
        put(empty[g], centre[0])
    covariances, centres = _covariances(source, target, group_of, empty)
    return _dual_quaternions(_rotations(covariances, overall), centres)


@kernel
def _covariances(
    source: Floats, target: Floats, group_of: Ints, empty: Floats
) -> tuple[Floats, Floats]:
    """Covariances (G, 9) of target with source, and their centres side by side (G, 6).

    `empty` (G, 6) are the centres of groups without a point.
    """
    count = len(empty)
    sizes = np.zeros(count)
    centres = np.zeros((count, 6))
    for h in range(len(group_of)):
        g = group_of[h]
        if g >= 0:
            sizes[g] += 1.0
            for axis in range(3):
                centres[g, axis] += source[h, axis]
                centres[g, 3 + axis] += target[h, axis]
    for g in range(count):
        for axis in range(6):
            centres[g, axis] = centres[g, axis] / sizes[g] if sizes[g] > 0.0 else empty[g, axis]
    S = np.zeros((count, 9))
    for h in range(len(group_of)):
        g = group_of[h]
        if g < 0:
            continue
        for row in range(3):
            offset = target[h, row] - centres[g, 3 + row]
            for column in range(3):
                S[g, 3 * row + column] += offset * (source[h, column] - centres[g, column])
    return S, centres


@kernel
def _rotations(S: Floats, prior: Floats) -> Floats:
    """Rotations (G, 9) nearest to covariances S (G, 9), with a prior (9,) where ambiguous."""
    count = len(S)
    R = np.empty((count, 9))
    lanes = np.empty(SCRATCH)
    for first in range(0, count, LANES):
        size = min(LANES, count - first)
        for k in range(size):
            strength = _prior_strength(S[first + k])
            for entry in range(9):
                lanes[entry * LANES + k] = S[first + k, entry] + strength * prior[entry]
        fit_rotations(lanes, size)
        for k in range(size):
            for entry in range(9):
                R[first + k, entry] = lanes[(9 + entry) * LANES + k]
    return R


@kernel
def _prior_strength(S: Floats) -> float:
    """The weight of the prior for a covariance (9,): zero unless its points lie on a line."""
    a, b, c, d, e, f, g, h, i = S[0], S[1], S[2], S[3], S[4], S[5], S[6], S[7], S[8]
    norm2 = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + i * i
    cofactors2 = (
        (e * i - f * h) ** 2 + (f * g - d * i) ** 2 + (d * h - e * g) ** 2
        + (c * h - b * i) ** 2 + (a * i - c * g) ** 2 + (b * g - a * h) ** 2
        + (b * f - c * e) ** 2 + (c * d - a * f) ** 2 + (a * e - b * d) ** 2
    )  # fmt: skip
    if cofactors2 > (_COLLINEAR * norm2) ** 2:
        return 0.0
    return float(max(_PRIOR * math.sqrt(norm2), 1e-100))


@kernel
def _dual_quaternions(rotations: Floats, centres: Floats) -> Floats:
    motions = np.empty((len(rotations), 8))
    for g in range(len(rotations)):
        _dual_quaternion(rotations[g], centres[g], motions[g])
    return motions


@kernel
def _dual_quaternion(R: Floats, centres: Floats, out: Floats) -> None:
    """The motion x -> R (x - source centre) + target centre as a unit dual quaternion (8,)."""
    trace = R[0] + R[4] + R[8]
    # Shepperd 1978: divide by the largest of the four components.
    if trace > R[0] and trace > R[4] and trace > R[8]:
        w, x, y, z = 1.0 + trace, R[7] - R[5], R[2] - R[6], R[3] - R[1]
    elif R[0] > R[4] and R[0] > R[8]:
        w, x, y, z = R[7] - R[5], 1.0 + R[0] - R[4] - R[8], R[1] + R[3], R[2] + R[6]
    elif R[4] > R[8]:
        w, x, y, z = R[2] - R[6], R[1] + R[3], 1.0 + R[4] - R[0] - R[8], R[5] + R[7]
    else:
        w, x, y, z = R[3] - R[1], R[2] + R[6], R[5] + R[7], 1.0 + R[8] - R[0] - R[4]
    s = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w * s, x * s, y * s, z * s
    t0 = 0.5 * (centres[3] - R[0] * centres[0] - R[1] * centres[1] - R[2] * centres[2])
    t1 = 0.5 * (centres[4] - R[3] * centres[0] - R[4] * centres[1] - R[5] * centres[2])
    t2 = 0.5 * (centres[5] - R[6] * centres[0] - R[7] * centres[1] - R[8] * centres[2])
    out[0], out[1], out[2], out[3] = w, x, y, z
    out[4] = -t0 * x - t1 * y - t2 * z
    out[5] = t0 * w + t1 * z - t2 * y
    out[6] = t1 * w + t2 * x - t0 * z
    out[7] = t2 * w + t0 * y - t1 * x


@parallel_kernel
def move_along(
    x: Floats, groups: NDArray[np.uint32], weights: Floats, motions: Floats, out: Floats
) -> None:
    """Move points x (N, 3) by their blended motions (G, 8) into out (N, 3); they may be the same.

    Source: Kavan et al. 2007, Skinning with dual quaternions, algorithm 1.
    """
    for i in prange(len(groups)):
        g, m = groups[i, 0], weights[i, 0]
        p0, p1, p2, p3 = motions[g, 0], motions[g, 1], motions[g, 2], motions[g, 3]
        w, a, b, c = m * p0, m * p1, m * p2, m * p3
        dw, da, db, dc = m * motions[g, 4], m * motions[g, 5], m * motions[g, 6], m * motions[g, 7]
        for k in range(1, KEPT):
            g = groups[i, k]
            q0, q1, q2, q3 = motions[g, 0], motions[g, 1], motions[g, 2], motions[g, 3]
            # Of the two quaternions of a rotation, take the one nearer to the first group's.
            m = math.copysign(weights[i, k], q0 * p0 + q1 * p1 + q2 * p2 + q3 * p3)
            w, a, b, c = w + m * q0, a + m * q1, b + m * q2, c + m * q3
            dw, da = dw + m * motions[g, 4], da + m * motions[g, 5]
            db, dc = db + m * motions[g, 6], dc + m * motions[g, 7]
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        moved = path((w, a, b, c), (dw, da, db, dc), (x0, x1, x2))
        out[i, 0], out[i, 1], out[i, 2] = x0 + moved[0], x1 + moved[1], x2 + moved[2]


@kernel
def path(q: Quaternion, d: Quaternion, x: Vector) -> Vector:
    """Return the displacement of a point by a dual quaternion q + e d, scalars first."""
    w, a, b, c = q
    dw, da, db, dc = d
    s = 2.0 / (w * w + a * a + b * b + c * c)
    # v = q x q* + 2 (q d* 's vector part), both over |q|^2
    c0 = b * x[2] - c * x[1] + w * x[0]
    c1 = c * x[0] - a * x[2] + w * x[1]
    c2 = a * x[1] - b * x[0] + w * x[2]
    t0 = w * da - a * dw + b * dc - c * db
    t1 = w * db - b * dw + c * da - a * dc
    t2 = w * dc - c * dw + a * db - b * da
    return (
        s * (b * c2 - c * c1 + t0),
        s * (c * c0 - a * c2 + t1),
        s * (a * c1 - b * c0 + t2),
    )


def follow(points: Floats, influences: Influences, motions: Floats, out: Floats) -> None:
    """Move points (N, 3) by the motions (G, 8) that they follow; write them to out (N, 3)."""
    move_along(points, influences.groups, influences.weights, motions, out)


def follow_one_group(group_of: Ints) -> Influences:
    """Return influences of points that each follow a single group, (N,)."""
    groups = np.repeat(group_of.astype(np.uint32)[:, None], KEPT, axis=1)
    return Influences(groups, np.full(groups.shape, 1.0 / KEPT))


def farthest_motion(motions: Floats, points: Floats, group_of: Ints) -> tuple[float, float]:
    """Return the largest turn [rad] and the longest path of points (H, 3) under motions (G, 8).

    Points without a group, whose `group_of` (H,) is -1, do not count.
    """
    turn, path = _farthest(motions, points, group_of)
    return turn, path


@kernel
def _farthest(motions: Floats, points: Floats, group_of: Ints) -> tuple[float, float]:
    half = squared = 0.0
    for g in range(len(motions)):
        m = motions[g]
        sine = math.sqrt(m[1] * m[1] + m[2] * m[2] + m[3] * m[3])
        half = max(half, math.atan2(sine, abs(m[0])))
    for h in range(len(points)):
        if group_of[h] >= 0:
            m = motions[group_of[h]]
            x = (points[h, 0], points[h, 1], points[h, 2])
            moved = path((m[0], m[1], m[2], m[3]), (m[4], m[5], m[6], m[7]), x)
            gone = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]
            squared = max(squared, gone)
    return 2.0 * half, math.sqrt(squared)
