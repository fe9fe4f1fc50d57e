"""The rotation nearest to a 3x3 matrix, for many matrices at once.

R maximises trace(R^T S) over proper rotations (Kabsch 1976; Sorkine and Alexa 2007, eq. (6)), also
where S is planar, a line, a point or a reflection. The fast path is the closed form of Markley 1993
(Attitude determination using vector observations: a fast optimal matrix algorithm), with the
largest root of its quartic. It has no branch and no trigonometry, so the compiler works on whole
vectors of matrices. It runs in several short passes: while a division is pending, a processor can
begin the next vector only if its instructions follow soon. Where the closed form is ill-conditioned
(two rotations fit nearly equally well), a check detects that, and Horn's 4x4 eigenproblem (Horn
1987) with Jacobi's method replaces it.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.kernels.compiled import kernel
from solvers.linear.laplacian import Floats

_TINY = 1e-300
_ORTHOGONAL = 1e-16  # squared; a Newton-Schulz step takes anything nearer to 1e-16
_NEARLY_ORTHOGONAL = 1e-9  # squared; two steps do


# LANES matrices are processed at once, in a flat array of rows of LANES numbers: 9 rows of the
# matrices, 9 of their rotations, 1 of the error. With a single array and constant strides the
# compiler can prove that nothing overlaps, which vector instructions require. Before the rotations
# are known, their rows hold the coefficients of the quartic and its root.
LANES = 64
_ROTATION = 9 * LANES
_DEFECT = 18 * LANES
SCRATCH = 19 * LANES
_NORM2, _DET, _COF2, _ROOT = 9 * LANES, 10 * LANES, 11 * LANES, 12 * LANES


@kernel
def fit_rotations(lanes: Floats, count: int) -> None:
    """Fill rows 9 to 17 of `lanes` (SCRATCH,) with the rotations nearest to rows 0 to 8.

    Only the first `count` of the LANES columns are used; matrices are row-major.
    """
    _start_roots(lanes, count)
    _polish_roots(lanes, count)
    _fit_well_conditioned(lanes, count)
    _straighten(lanes, 0, count)
    for k in range(count):
        if not lanes[_DEFECT + k] < _ORTHOGONAL:
            if lanes[_DEFECT + k] < _NEARLY_ORTHOGONAL:
                _straighten(lanes, k, k + 1)
            else:
                _fit_one(lanes, k)


@kernel
def _start_roots(lanes: Floats, count: int) -> None:
    """The coefficients of Markley's quartic, and a start for its largest root.

    With n the squared norm of the matrix, it is (l^2 - n)^2 - 8 l det - 4 cof2. The start is its
    root where det = 0; the quartic is convex from there on.
    """
    for k in range(count):
        a, b, c = lanes[k], lanes[LANES + k], lanes[2 * LANES + k]
        d, e, f = lanes[3 * LANES + k], lanes[4 * LANES + k], lanes[5 * LANES + k]
        g, h, i = lanes[6 * LANES + k], lanes[7 * LANES + k], lanes[8 * LANES + k]
        norm2 = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + i * i
        ca, cb, cc = e * i - f * h, f * g - d * i, d * h - e * g
        cd, ce, cf = c * h - b * i, a * i - c * g, b * g - a * h
        cg, ch, ci = b * f - c * e, c * d - a * f, a * e - b * d
        cof2 = (
            ca * ca + cb * cb + cc * cc + cd * cd + ce * ce + cf * cf + cg * cg + ch * ch + ci * ci
        )
        lanes[_NORM2 + k] = norm2
        lanes[_DET + k] = a * ca + b * cb + c * cc
        lanes[_COF2 + k] = cof2
        lanes[_ROOT + k] = math.sqrt(norm2 + 2.0 * math.sqrt(cof2))


@kernel
def _polish_roots(lanes: Floats, count: int) -> None:
    """Three steps of Halley's method, which converges to the largest of the four real roots."""
    for k in range(count):
        norm2, det, cof2 = lanes[_NORM2 + k], lanes[_DET + k], lanes[_COF2 + k]
        root = lanes[_ROOT + k]
        for _ in range(3):
            excess = root * root - norm2
            value = excess * excess - 8.0 * det * root - 4.0 * cof2
            slope = 4.0 * root * excess - 8.0 * det
            half_bend = 6.0 * root * root - 2.0 * norm2
            root -= value * slope / (slope * slope - value * half_bend + _TINY)
        lanes[_ROOT + k] = root


@kernel
def _fit_well_conditioned(lanes: Floats, count: int) -> None:
    """The closed form, R = ((kappa + n) S + root cof(S) - S S^T S) / (kappa root - det)."""
    for k in range(count):
        a, b, c = lanes[k], lanes[LANES + k], lanes[2 * LANES + k]
        d, e, f = lanes[3 * LANES + k], lanes[4 * LANES + k], lanes[5 * LANES + k]
        g, h, i = lanes[6 * LANES + k], lanes[7 * LANES + k], lanes[8 * LANES + k]
        ca, cb, cc = e * i - f * h, f * g - d * i, d * h - e * g
        cd, ce, cf = c * h - b * i, a * i - c * g, b * g - a * h
        cg, ch, ci = b * f - c * e, c * d - a * f, a * e - b * d
        norm2, root, det = lanes[_NORM2 + k], lanes[_ROOT + k], lanes[_DET + k]
        kappa = 0.5 * (root * root - norm2)
        z = 1.0 / (kappa * root - det + _TINY)
        m, n = (kappa + norm2) * z, root * z
        xx, yy = m - z * (a * a + d * d + g * g), m - z * (b * b + e * e + h * h)
        zz = m - z * (c * c + f * f + i * i)
        xy, xz = z * (a * b + d * e + g * h), z * (a * c + d * f + g * i)
        yz = z * (b * c + e * f + h * i)
        lanes[_ROTATION + k] = a * xx - b * xy - c * xz + n * ca
        lanes[_ROTATION + LANES + k] = b * yy - a * xy - c * yz + n * cb
        lanes[_ROTATION + 2 * LANES + k] = c * zz - a * xz - b * yz + n * cc
        lanes[_ROTATION + 3 * LANES + k] = d * xx - e * xy - f * xz + n * cd
        lanes[_ROTATION + 4 * LANES + k] = e * yy - d * xy - f * yz + n * ce
        lanes[_ROTATION + 5 * LANES + k] = f * zz - d * xz - e * yz + n * cf
        lanes[_ROTATION + 6 * LANES + k] = g * xx - h * xy - i * xz + n * cg
        lanes[_ROTATION + 7 * LANES + k] = h * yy - g * xy - i * yz + n * ch
        lanes[_ROTATION + 8 * LANES + k] = i * zz - g * xz - h * yz + n * ci


@kernel
def _straighten(lanes: Floats, first: int, last: int) -> None:
    """A Newton-Schulz step for columns first to last, and their distance from orthogonality.

    An error of the root changes only R's singular values, which are then not quite one. This step
    corrects them.
    """
    for k in range(first, last):
        a, b = lanes[_ROTATION + k], lanes[_ROTATION + LANES + k]
        c, d = lanes[_ROTATION + 2 * LANES + k], lanes[_ROTATION + 3 * LANES + k]
        e, f = lanes[_ROTATION + 4 * LANES + k], lanes[_ROTATION + 5 * LANES + k]
        g, h = lanes[_ROTATION + 6 * LANES + k], lanes[_ROTATION + 7 * LANES + k]
        i = lanes[_ROTATION + 8 * LANES + k]
        xx, yy = a * a + d * d + g * g - 1.0, b * b + e * e + h * h - 1.0
        zz = c * c + f * f + i * i - 1.0
        xy, xz, yz = a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i
        lanes[_DEFECT + k] = xx * xx + yy * yy + zz * zz + xy * xy + xz * xz + yz * yz
        xx, yy, zz = 1.0 - 0.5 * xx, 1.0 - 0.5 * yy, 1.0 - 0.5 * zz
        xy, xz, yz = -0.5 * xy, -0.5 * xz, -0.5 * yz
        lanes[_ROTATION + k] = a * xx + b * xy + c * xz
        lanes[_ROTATION + LANES + k] = a * xy + b * yy + c * yz
        lanes[_ROTATION + 2 * LANES + k] = a * xz + b * yz + c * zz
        lanes[_ROTATION + 3 * LANES + k] = d * xx + e * xy + f * xz
        lanes[_ROTATION + 4 * LANES + k] = d * xy + e * yy + f * yz
        lanes[_ROTATION + 5 * LANES + k] = d * xz + e * yz + f * zz
        lanes[_ROTATION + 6 * LANES + k] = g * xx + h * xy + i * xz
        lanes[_ROTATION + 7 * LANES + k] = g * xy + h * yy + i * yz
        lanes[_ROTATION + 8 * LANES + k] = g * xz + h * yz + i * zz


@kernel
def _fit_one(lanes: Floats, k: int) -> None:
    """Fit the rotation of column k, however degenerate its matrix."""
    S = lanes[k:_ROTATION:LANES]
    largest = 0.0
    for entry in range(9):
        largest = max(largest, abs(S[entry]))
    s = 1.0 / largest if largest > _TINY else 0.0
    a, b, c = S[0] * s, S[1] * s, S[2] * s
    d, e, f = S[3] * s, S[4] * s, S[5] * s
    g, h, i = S[6] * s, S[7] * s, S[8] * s
    horn = np.empty((4, 4))
    horn[0, 0], horn[1, 1], horn[2, 2], horn[3, 3] = a + e + i, a - e - i, e - a - i, i - a - e
    horn[0, 1], horn[0, 2], horn[0, 3] = h - f, c - g, d - b
    horn[1, 2], horn[1, 3], horn[2, 3] = b + d, c + g, f + h
    w, x, y, z = _largest_eigenvector(horn)
    R = lanes[_ROTATION + k : _DEFECT : LANES]
    R[0], R[1], R[2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[3], R[4], R[5] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    R[6], R[7], R[8] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


@kernel
def _largest_eigenvector(A: Floats) -> tuple[float, float, float, float]:
    """Jacobi's method on a symmetric 4x4 matrix whose upper half is given; A is overwritten."""
    V = np.eye(4)
    for i in range(4):
        for j in range(i):
            A[i, j] = A[j, i]
    for _ in range(12):  # sweeps; convergence is quadratic after two or three
        off = 0.0
        for p in range(3):
            for q in range(p + 1, 4):
                off += A[p, q] * A[p, q]
        if off < 1e-34:
            break
        for p in range(3):
            for q in range(p + 1, 4):
                if A[p, q] != 0.0:
                    _rotate(A, V, p, q)
    best = 0
    for i in range(1, 4):
        if A[i, i] > A[best, best]:
            best = i
    w, x, y, z = V[0, best], V[1, best], V[2, best], V[3, best]
    s = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return w * s, x * s, y * s, z * s


@kernel
def _rotate(A: Floats, V: Floats, p: int, q: int) -> None:
    """One Jacobi rotation that makes A[p, q] zero, accumulated in V."""
    theta = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
    t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
    cosine = 1.0 / math.sqrt(t * t + 1.0)
    sine = t * cosine
    for i in range(4):
        u, v = A[i, p], A[i, q]
        A[i, p], A[i, q] = cosine * u - sine * v, sine * u + cosine * v
    for i in range(4):
        u, v = A[p, i], A[q, i]
        A[p, i], A[q, i] = cosine * u - sine * v, sine * u + cosine * v
        u, v = V[i, p], V[i, q]
        V[i, p], V[i, q] = cosine * u - sine * v, sine * u + cosine * v
