"""Compiled kernels of squash and stretch: the scales, axes and volumes of cells.

The arrays are those of `solvers.deform.arap_kernels`. A cell's edges occur only in its covariance
S = sum of w e' e^T: with the best rotation R, trace(S R^T) is the numerator of the scale in
eq. (8), and R^T S is the cell's stretch in rest coordinates. So the pose state does not read the
edges again.

Source: Celikcan, Yaz and Capin 2015, section 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from numba import get_thread_id, prange  # type: ignore[attr-defined]  # numba exports it untyped

from solvers.deform.arap_cells import Cells
from solvers.deform.arap_kernels import covariances
from solvers.deform.cell_planes import Planes
from solvers.deform.rotation_fit import LANES, fit_rotations
from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.linear.laplacian import Floats

_R = 9 * LANES

# Scales are clamped to this range, so that no cell collapses to a point or grows without bound.
LEAST_SCALE, LARGEST_SCALE = 0.2, 5.0

_TINY = 1e-300

_Rotate = Callable[[Floats, int, Floats], None]
_Shape = Callable[[Floats, int, Planes, float, tuple[Floats, Floats]], None]


class Fit(NamedTuple):
    """The arrays that a local step writes; a named tuple, because compiled kernels accept those.

    `matrices` (N, 9) are the cells' s R or V R, `scales` (N,) their scales, `laplace_x` (N, 3) is
    L x, and `room` (threads, SCRATCH) is each thread's scratch space.
    """

    matrices: Floats
    scales: Floats
    laplace_x: Floats
    room: Floats


_LocalStep = Callable[[Floats, Cells, Planes, float, Fit], None]


@parallel_kernel
def rest_covariances(rest: Floats, cells: Cells, out: Fit) -> None:
    """Write the covariance of each cell's edges at rest to out.matrices."""
    matrices, _, laplace_x, room = out  # numba drops writes through the tuple
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes, first = room[get_thread_id()], block * LANES
        covariances(rest, cells, first, min(LANES, count - first), lanes, laplace_x)
        for k in range(min(LANES, count - first)):
            for entry in range(9):
                matrices[first + k, entry] = lanes[entry * LANES + k]


@kernel
def _fit_rotations(lanes: Floats, first: int, R: Floats) -> None:
    fit_rotations(lanes, min(LANES, len(R) - first))


@kernel
def _load_rotations(lanes: Floats, first: int, R: Floats) -> None:
    for k in range(min(LANES, len(R) - first)):
        for entry in range(9):
            lanes[_R + entry * LANES + k] = R[first + k, entry]


@kernel
def _scale_block(
    lanes: Floats, first: int, planes: Planes, cartoon: float, out: tuple[Floats, Floats]
) -> None:
    """The scales of LANES cells from their covariances and rotations, and scale times rotation."""
    extents = planes.extents
    matrices, scales = out
    for k in range(min(LANES, len(scales) - first)):
        i = first + k
        trace = 0.0
        for entry in range(9):
            trace += lanes[entry * LANES + k] * lanes[_R + entry * LANES + k]
        s = 1.0 + (trace - extents[i, 0]) * extents[i, 1]
        s = 1.0 + cartoon * (min(max(s, LEAST_SCALE), LARGEST_SCALE) - 1.0)
        scales[i] = s
        for entry in range(9):
            matrices[i, entry] = s * lanes[_R + entry * LANES + k]


@kernel
def _pose_block(
    lanes: Floats, first: int, planes: Planes, gain: float, out: tuple[Floats, Floats]
) -> None:
    """V R of LANES cells from their covariances and rotations, and the scales on the axes."""
    axes = planes.axes
    matrices, scales = out
    size = min(LANES, len(scales) - first)
    _stretch(lanes, size, planes, first)
    _volume_scales(lanes, size, gain)
    for k in range(size):
        i = first + k
        scales[i] = lanes[k]
        aa, ab, bb = lanes[LANES + k], lanes[2 * LANES + k], lanes[3 * LANES + k]
        off = lanes[4 * LANES + k]
        a0, a1, a2 = axes[i, 0], axes[i, 1], axes[i, 2]
        b0, b1, b2 = axes[i, 3], axes[i, 4], axes[i, 5]
        for row in range(3):
            r0 = lanes[_R + 3 * row * LANES + k]
            r1 = lanes[_R + (3 * row + 1) * LANES + k]
            r2 = lanes[_R + (3 * row + 2) * LANES + k]
            ra, rb = r0 * a0 + r1 * a1 + r2 * a2, r0 * b0 + r1 * b1 + r2 * b2
            pa, pb = ra * aa + rb * ab, ra * ab + rb * bb
            matrices[i, 3 * row] = off * r0 + pa * a0 + pb * b0
            matrices[i, 3 * row + 1] = off * r1 + pa * a1 + pb * b1
            matrices[i, 3 * row + 2] = off * r2 + pa * a2 + pb * b2


@kernel
def _stretch(lanes: Floats, size: int, planes: Planes, first: int) -> None:
    """Write the stretch of each cell in its rest plane to rows 0 to 2 of `lanes`: aa, ab, bb.

    The stretch is R^T S between the rest axes a and b, over their extents: the identity at rest.
    """
    axes, shares = planes.axes, planes.shares
    for k in range(size):
        i = first + k
        a0, a1, a2 = axes[i, 0], axes[i, 1], axes[i, 2]
        b0, b1, b2 = axes[i, 3], axes[i, 4], axes[i, 5]
        faa = fab = fbb = 0.0
        for row in range(3):
            s0 = lanes[3 * row * LANES + k]
            s1 = lanes[(3 * row + 1) * LANES + k]
            s2 = lanes[(3 * row + 2) * LANES + k]
            r0 = lanes[_R + 3 * row * LANES + k]
            r1 = lanes[_R + (3 * row + 1) * LANES + k]
            r2 = lanes[_R + (3 * row + 2) * LANES + k]
            ra, rb = r0 * a0 + r1 * a1 + r2 * a2, r0 * b0 + r1 * b1 + r2 * b2
            sa, sb = s0 * a0 + s1 * a1 + s2 * a2, s0 * b0 + s1 * b1 + s2 * b2
            faa += ra * sa
            fab += ra * sb + rb * sa
            fbb += rb * sb
        wa, wb = shares[i, 0], shares[i, 1]
        lanes[k] = wa * wa * faa + shares[i, 2]
        lanes[LANES + k] = 0.5 * wa * wb * fab
        lanes[2 * LANES + k] = wb * wb * fbb + shares[i, 3]


@kernel
def _volume_scales(lanes: Floats, size: int, gain: float) -> None:
    """Replace stretches in rows 0 to 2 of `lanes` by s, V minus `off` (aa, ab, bb), and `off`.

    With the eigenvectors u and v of the stretch, the axis is W = q u u^T + (1 - q) v v^T; q is the
    share of the larger strain in the sum of both, each to the power of 16. So q is one except where
    both strains are nearly equal, where a single axis would flicker. In the plane V is
    c I + (g - c) W. Across the plane V is the number that makes the determinant one: also c where q
    is one, as in the paper.

    Source: Celikcan et al. 2015, eqs. (8), (10) and (12), with s' = 1 + gain (s - 1).
    """
    for k in range(size):
        faa, fab, fbb = lanes[k], lanes[LANES + k], lanes[2 * LANES + k]
        middle, half = 0.5 * (faa + fbb), 0.5 * (faa - fbb)
        radius = math.sqrt(half * half + fab * fab)
        f = min(max(middle + radius, LEAST_SCALE), LARGEST_SCALE)
        h = min(max(middle - radius, LEAST_SCALE), LARGEST_SCALE)
        # f - 1/f is nearly twice log f: half the length weighs as much as double. Times f h here.
        e, d = (f * f - 1.0) * h, (h * h - 1.0) * f
        e, d = e * e, d * d
        ratio = min(e, d) / max(e, d, _TINY)
        ratio *= ratio
        ratio *= ratio
        ratio *= ratio
        lesser = ratio / (1.0 + ratio)
        q = 1.0 - lesser if e >= d else lesser
        lean = (q - 0.5) / max(radius, 1e-12)
        s = q * f + (1.0 - q) * h
        g = min(max(1.0 + gain * (s - 1.0), LEAST_SCALE), LARGEST_SCALE)
        c = 1.0 / math.sqrt(g)
        off = 1.0 / (c * g + (g - c) * (g - c) * q * (1.0 - q))
        lanes[k] = s
        lanes[LANES + k] = c - off + (g - c) * (0.5 + lean * half)
        lanes[2 * LANES + k] = (g - c) * lean * fab
        lanes[3 * LANES + k] = c - off + (g - c) * (0.5 - lean * half)
        lanes[4 * LANES + k] = off


def _local_step(rotate: _Rotate, shape: _Shape) -> _LocalStep:
    """A local step: the cells' covariances, then `rotate`, then `shape`, LANES cells at a time."""

    @parallel_kernel
    def step(x: Floats, cells: Cells, planes: Planes, amount: float, out: Fit) -> None:
        matrices, scales, laplace_x, room = out
        count = len(cells.starts) - 1
        for block in prange((count + LANES - 1) // LANES):
            lanes, first = room[get_thread_id()], block * LANES
            covariances(x, cells, first, min(LANES, count - first), lanes, laplace_x)
            rotate(lanes, first, matrices)
            shape(lanes, first, planes, amount, (matrices, scales))

    return step


fit_scaled_cells = _local_step(_fit_rotations, _scale_block)
"""`fit_scaled_cells(x, cells, planes, cartoon, out)`: the shape state's local step.

It gives s_i R_i of each cell, with s_i - 1 multiplied by `cartoon`.
Source: Celikcan et al. 2015, eqs. (5), (6) and (8).
"""

scale_cells = _local_step(_load_rotations, _scale_block)
"""Like `fit_scaled_cells`, with the rotations that `out` already holds."""

fit_pose_cells = _local_step(_fit_rotations, _pose_block)
"""`fit_pose_cells(x, cells, planes, gain, out)`: the pose state's local step.

It gives V_i R_i of each cell, and the scale on its primary axis.
Source: Celikcan et al. 2015, eqs. (8) and (10) to (12), the axis from the stretch in the cell's
plane; see `solvers.squash_stretch`.
"""

pose_cells = _local_step(_load_rotations, _pose_block)
"""Like `fit_pose_cells`, with the rotations that `out` already holds."""
