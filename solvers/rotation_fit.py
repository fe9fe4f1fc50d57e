"""The rotation nearest to a 3x3 matrix, for many matrices at once.

R maximises trace(R^T S) over proper rotations (Kabsch 1976; Sorkine and Alexa 2007, eq. (6)), also
where S is planar, a line, a point or a reflection. The fast path is the closed form of Markley 1993
(Attitude determination using vector observations: a fast optimal matrix algorithm), on the largest
root of its quartic; it has no branch and no trigonometry, so the compiler runs it on a whole vector
of matrices. Where the closed form is ill-conditioned (two rotations nearly as good as each other)
it is checked and replaced by Horn's 4x4 eigenproblem (Horn 1987) with Jacobi's method.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled import kernel
from solvers.laplacian import Floats

_TINY = 1e-300
_NOT_ORTHOGONAL = 1e-9  # squared; two Newton-Schulz steps take anything nearer to 1e-16


# Matrices are worked on LANES at a time, in a flat array of rows of LANES numbers: 9 rows of the
# matrices, 9 of their rotations, 1 of the error. With a single array and constant strides the
# compiler can prove that nothing overlaps, which it needs in order to use vector instructions.
LANES = 64
_ROTATION = 9 * LANES
_DEFECT = 18 * LANES
SCRATCH = 19 * LANES


@kernel
def fit_rotations(lanes: Floats, count: int) -> None:
    """Fill rows 9 to 17 of `lanes` (SCRATCH,) with the rotations nearest to rows 0 to 8.

    Only the first `count` of the LANES columns are looked at; matrices are row-major.
    """
    _fit_well_conditioned(lanes, count)
    for k in range(count):
        if not lanes[_DEFECT + k] < _NOT_ORTHOGONAL:
            _fit_one(lanes, k)


@kernel
def _fit_well_conditioned(lanes: Floats, count: int) -> None:
    for k in range(count):
        a, b, c = lanes[k], lanes[LANES + k], lanes[2 * LANES + k]
        d, e, f = lanes[3 * LANES + k], lanes[4 * LANES + k], lanes[5 * LANES + k]
        g, h, i = lanes[6 * LANES + k], lanes[7 * LANES + k], lanes[8 * LANES + k]
        norm2 = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + i * i
        s = 1.0 / math.sqrt(max(norm2, _TINY))
        a, b, c, d, e, f, g, h, i = a * s, b * s, c * s, d * s, e * s, f * s, g * s, h * s, i * s
        # The cofactors, the determinant, and B^T B of the matrix B of norm one.
        ca, cb, cc = e * i - f * h, f * g - d * i, d * h - e * g
        cd, ce, cf = c * h - b * i, a * i - c * g, b * g - a * h
        cg, ch, ci = b * f - c * e, c * d - a * f, a * e - b * d
        det = a * ca + b * cb + c * cc
        cof2 = (
            ca * ca + cb * cb + cc * cc + cd * cd + ce * ce + cf * cf + cg * cg + ch * ch + ci * ci
        )
        xx, yy, zz = a * a + d * d + g * g, b * b + e * e + h * h, c * c + f * f + i * i
        xy, xz, yz = a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i
        # Markley's quartic (l^2 - 1)^2 - 8 l det - 4 cof2. This start is its root where det = 0;
        # the quartic is convex from there on, so that Newton cannot miss the largest root.
        root = math.sqrt(1.0 + 2.0 * math.sqrt(cof2))
        for _ in range(4):
            excess = root * root - 1.0
            value = excess * excess - 8.0 * det * root - 4.0 * cof2
            root -= value / (4.0 * root * excess - 8.0 * det + _TINY)
        kappa = 0.5 * (root * root - 1.0)
        z = 1.0 / (kappa * root - det + _TINY)
        m, n = (kappa + 1.0) * z, root * z
        # R = ((kappa + 1) B + root cof(B) - B B^T B) / (kappa root - det)
        r0 = m * a + n * ca - z * (a * xx + b * xy + c * xz)
        r1 = m * b + n * cb - z * (a * xy + b * yy + c * yz)
        r2 = m * c + n * cc - z * (a * xz + b * yz + c * zz)
        r3 = m * d + n * cd - z * (d * xx + e * xy + f * xz)
        r4 = m * e + n * ce - z * (d * xy + e * yy + f * yz)
        r5 = m * f + n * cf - z * (d * xz + e * yz + f * zz)
        r6 = m * g + n * cg - z * (g * xx + h * xy + i * xz)
        r7 = m * h + n * ch - z * (g * xy + h * yy + i * yz)
        r8 = m * i + n * ci - z * (g * xz + h * yz + i * zz)
        # An error of the root leaves R's singular vectors right and its singular values a little
        # off one; Newton-Schulz steps put them back.
        worst = 0.0
        for step in range(2):
            xx, yy, zz = (
                r0 * r0 + r3 * r3 + r6 * r6,
                r1 * r1 + r4 * r4 + r7 * r7,
                r2 * r2 + r5 * r5 + r8 * r8,
            )
            xy, xz, yz = (
                r0 * r1 + r3 * r4 + r6 * r7,
                r0 * r2 + r3 * r5 + r6 * r8,
                r1 * r2 + r4 * r5 + r7 * r8,
            )
            if step == 0:
                worst = (
                    (xx - 1.0) * (xx - 1.0)
                    + (yy - 1.0) * (yy - 1.0)
                    + (zz - 1.0) * (zz - 1.0)
                    + xy * xy
                    + xz * xz
                    + yz * yz
                )
            xx, yy, zz = 1.5 - 0.5 * xx, 1.5 - 0.5 * yy, 1.5 - 0.5 * zz
            xy, xz, yz = -0.5 * xy, -0.5 * xz, -0.5 * yz
            r0, r1, r2 = (
                r0 * xx + r1 * xy + r2 * xz,
                r0 * xy + r1 * yy + r2 * yz,
                r0 * xz + r1 * yz + r2 * zz,
            )
            r3, r4, r5 = (
                r3 * xx + r4 * xy + r5 * xz,
                r3 * xy + r4 * yy + r5 * yz,
                r3 * xz + r4 * yz + r5 * zz,
            )
            r6, r7, r8 = (
                r6 * xx + r7 * xy + r8 * xz,
                r6 * xy + r7 * yy + r8 * yz,
                r6 * xz + r7 * yz + r8 * zz,
            )
        lanes[_ROTATION + k] = r0
        lanes[_ROTATION + LANES + k] = r1
        lanes[_ROTATION + 2 * LANES + k] = r2
        lanes[_ROTATION + 3 * LANES + k] = r3
        lanes[_ROTATION + 4 * LANES + k] = r4
        lanes[_ROTATION + 5 * LANES + k] = r5
        lanes[_ROTATION + 6 * LANES + k] = r6
        lanes[_ROTATION + 7 * LANES + k] = r7
        lanes[_ROTATION + 8 * LANES + k] = r8
        lanes[_DEFECT + k] = worst


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
