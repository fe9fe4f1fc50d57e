"""The cells of squash and stretch as compiled kernels: uniform scales, axes, and local volume.

The arrays are those of `solvers.deform.arap_kernels`. A cell's edges enter only through its
covariance S = sum of w e' e^T: with the best rotation R, trace(S R^T) is the numerator of the
scale in eq. (8), and R^T S holds the cell's stretch as its rest edges see it. So the second state
needs no second look at the edges.

Source: Celikcan, Yaz and Capin 2015, section 4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import get_thread_id, prange  # type: ignore[attr-defined]
from numpy.typing import NDArray

from solvers.deform.arap_cells import Cells
from solvers.deform.arap_kernels import covariances
from solvers.deform.rotation_fit import LANES, fit_rotations
from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.linear.laplacian import Floats

_R = 9 * LANES

# A scale outside this range counts as its end: no cell collapses to a point or grows for ever.
LEAST_SCALE, LARGEST_SCALE = 0.2, 5.0

# The most that a pressure may mend, in mean strains of the component times its volume. What no
# squash explains (a bend loses volume too) is then not pumped into the little that is squashed.
_MOST = 3.0

_TINY = 1e-300


class Planes(NamedTuple):
    """What the rest pose says of each cell; a named tuple, because kernels take one as it is.

    `extents` (N, 2) is trace C of the rest covariance C, and its inverse or 0. `axes` (N, 6) are
    two orthonormal rest directions that span the cell's edges best, and `shares` (N, 4), for each
    of them, the inverse root of its extent, damped, and what the damping took away.
    """

    extents: Floats
    axes: Floats
    shares: Floats


class Shell(NamedTuple):
    """The closed surfaces whose volumes are kept; a named tuple, because kernels take one as it is.

    Faces (F, 3) lie component by component, with fans over holes, which have no area; chunk c is
    the faces from `chunks[c]` to `chunks[c + 1]`, all of the component `parts[c]`, whose volume is
    taken from its vertex `origins[c]`. Around vertex i lie the `pairs` (3 F', 2) from `corners[i]`
    to `corners[i + 1]`: the other two vertices of each of its faces, in order, without the fans.
    """

    faces: NDArray[np.uint32]
    areas: Floats
    chunks: NDArray[np.int64]
    parts: NDArray[np.int64]
    origins: NDArray[np.uint32]
    corners: NDArray[np.uint32]
    pairs: NDArray[np.uint32]


class Fit(NamedTuple):
    """What a local step writes; a named tuple, because kernels take one as it is.

    `matrices` (N, 9) are the cells' s R or V R, `scales` (N,) their scales, `laplace_x` (N, 3) is
    L x, and `room` (threads, SCRATCH) is what each thread works in.
    """

    matrices: Floats
    scales: Floats
    laplace_x: Floats
    room: Floats


@parallel_kernel
def rest_covariances(rest: Floats, cells: Cells, out: Fit) -> None:
    """The covariance of each cell's edges at rest, into out.matrices."""
    matrices, _, laplace_x, room = out  # numba loses what is written through the tuple
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes, first = room[get_thread_id()], block * LANES
        covariances(rest, cells, first, min(LANES, count - first), lanes, laplace_x)
        for k in range(min(LANES, count - first)):
            for entry in range(9):
                matrices[first + k, entry] = lanes[entry * LANES + k]


@parallel_kernel
def fit_scaled_cells(x: Floats, cells: Cells, planes: Planes, cartoon: float, out: Fit) -> None:
    """The shape state's local step: s_i R_i of each cell, s_i drawn to one by 1 - cartoon.

    Source: Celikcan et al. 2015, eqs. (5), (6) and (8).
    """
    matrices, scales, laplace_x, room = out
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes, first = room[get_thread_id()], block * LANES
        covariances(x, cells, first, min(LANES, count - first), lanes, laplace_x)
        fit_rotations(lanes, min(LANES, count - first))
        _scale_block(lanes, first, planes, cartoon, (matrices, scales))


@parallel_kernel
def scale_cells(x: Floats, cells: Cells, planes: Planes, cartoon: float, out: Fit) -> None:
    """Like `fit_scaled_cells`, but the rotations are those that `out` holds already."""
    matrices, scales, laplace_x, room = out
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes, first = room[get_thread_id()], block * LANES
        covariances(x, cells, first, min(LANES, count - first), lanes, laplace_x)
        _load_rotations(lanes, first, matrices)
        _scale_block(lanes, first, planes, cartoon, (matrices, scales))


@parallel_kernel
def fit_pose_cells(x: Floats, cells: Cells, planes: Planes, gain: float, out: Fit) -> None:
    """The pose state's local step: V_i R_i of each cell, and the scale on its primary axis.

    Source: Celikcan et al. 2015, eqs. (8) and (10) to (12), the axis from the stretch in the
    cell's plane; see `solvers.squash_stretch`.
    """
    matrices, scales, laplace_x, room = out
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes, first = room[get_thread_id()], block * LANES
        covariances(x, cells, first, min(LANES, count - first), lanes, laplace_x)
        fit_rotations(lanes, min(LANES, count - first))
        _pose_block(lanes, first, planes, gain, (matrices, scales))


@parallel_kernel
def pose_cells(x: Floats, cells: Cells, planes: Planes, gain: float, out: Fit) -> None:
    """Like `fit_pose_cells`, but the rotations are those that `out` holds already."""
    matrices, scales, laplace_x, room = out
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes, first = room[get_thread_id()], block * LANES
        covariances(x, cells, first, min(LANES, count - first), lanes, laplace_x)
        _load_rotations(lanes, first, matrices)
        _pose_block(lanes, first, planes, gain, (matrices, scales))


@kernel
def _load_rotations(lanes: Floats, first: int, R: Floats) -> None:
    for k in range(min(LANES, len(R) - first)):
        for entry in range(9):
            lanes[_R + entry * LANES + k] = R[first + k, entry]


@kernel
def _scale_block(
    lanes: Floats, first: int, planes: Planes, cartoon: float, out: tuple[Floats, Floats]
) -> None:
    """The scales of LANES cells from their covariances and rotations, and both multiplied."""
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
    """The stretch of each cell in its rest plane into rows 0 to 2 of `lanes`: aa, ab, bb.

    It is R^T S between the rest axes a and b, over their extents: the identity at rest.
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
    """From stretches in rows 0 to 2 of `lanes` the scale s, V less `off` (aa, ab, bb), and `off`.

    With the eigenvectors u and v of the stretch, the axis is W = q u u^T + (1 - q) v v^T; q is the
    share of the larger strain in the sum of both, each to the power of 16. It is one but where both
    are nearly as large: there an axis would flicker. In the plane V is c I + (g - c) W, and off it
    what makes its determinant one: c as well where q is one, as in the paper.

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


@parallel_kernel
def strain_cells(scales: Floats, out: Floats) -> None:
    """How far each cell is from its rest length, |s - 1/s| / 2, out (N,)."""
    for i in prange(len(out)):
        out[i] = 0.5 * abs(scales[i] - 1.0 / scales[i])


@parallel_kernel
def push(x: Floats, shell: Shell, strains: Floats, fixed: NDArray[np.bool_], out: Floats) -> None:
    """How a pressure pushes the vertices, out (N, 3): area vectors times the strain of their cells.

    An area vector is the gradient of the volume. Fixed vertices are not pushed.
    """
    corners, pairs = shell.corners, shell.pairs
    for index in prange(len(out)):
        i = np.uint64(index)
        a0 = a1 = a2 = 0.0
        if not fixed[i]:
            x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
            for h in range(np.uint64(corners[i]), np.uint64(corners[i + np.uint64(1)])):
                j, k = np.uint64(pairs[h, 0]), np.uint64(pairs[h, 1])
                b0, b1, b2 = x[j, 0] - x0, x[j, 1] - x1, x[j, 2] - x2
                c0, c1, c2 = x[k, 0] - x0, x[k, 1] - x1, x[k, 2] - x2
                a0 += b1 * c2 - b2 * c1
                a1 += b2 * c0 - b0 * c2
                a2 += b0 * c1 - b1 * c0
            strain = strains[i] / 6.0
            a0, a1, a2 = a0 * strain, a1 * strain, a2 * strain
        out[i, 0], out[i, 1], out[i, 2] = a0, a1, a2


@parallel_kernel
def volume_terms(x: Floats, g: Floats, shell: Shell, strains: Floats, out: Floats) -> None:
    """What each chunk of the shell adds to its component's volume, out (chunks, 5).

    Columns 0 to 3 are the volume of x + m g as a polynomial in m, constant first; 4 the strains of
    the cells, times the rest areas on them.
    """
    faces, chunks, origins, areas = shell.faces, shell.chunks, shell.origins, shell.areas
    for chunk in prange(len(chunks) - 1):
        o = np.uint64(origins[chunk])
        o0, o1, o2 = x[o, 0], x[o, 1], x[o, 2]
        t0 = t1 = t2 = t3 = strained = 0.0
        for face in range(chunks[chunk], chunks[chunk + 1]):
            i, j = np.uint64(faces[face, 0]), np.uint64(faces[face, 1])
            k = np.uint64(faces[face, 2])
            p = x[i, 0] - o0, x[i, 1] - o1, x[i, 2] - o2
            q = x[j, 0] - o0, x[j, 1] - o1, x[j, 2] - o2
            r = x[k, 0] - o0, x[k, 1] - o1, x[k, 2] - o2
            u = g[i, 0], g[i, 1], g[i, 2]
            v = g[j, 0], g[j, 1], g[j, 2]
            w = g[k, 0], g[k, 1], g[k, 2]
            qr, vw = _cross(q, r), _cross(v, w)
            mixed = _cross(q, w), _cross(v, r)
            t0 += _dot(p, qr)
            t1 += _dot(u, qr) + _dot(p, mixed[0]) + _dot(p, mixed[1])
            t2 += _dot(p, vw) + _dot(u, mixed[0]) + _dot(u, mixed[1])
            t3 += _dot(u, vw)
            strained += areas[face] * (strains[i] + strains[j] + strains[k])
        out[chunk, 0], out[chunk, 1], out[chunk, 2] = t0 / 6.0, t1 / 6.0, t2 / 6.0
        out[chunk, 3], out[chunk, 4] = t3 / 6.0, strained / 3.0


_Vector = tuple[float, float, float]


@kernel
def _cross(a: _Vector, b: _Vector) -> _Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def _dot(a: _Vector, b: _Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@parallel_kernel
def add_scaled(pressures: Floats, part_of: NDArray[np.int64], g: Floats, x: Floats) -> None:
    """Move each vertex of x (N, 3) along g (N, 3) by the pressure in its component."""
    for i in prange(len(part_of)):
        m = pressures[part_of[i]]
        x[i, 0] += m * g[i, 0]
        x[i, 1] += m * g[i, 1]
        x[i, 2] += m * g[i, 2]


@kernel
def sum_parts(terms: Floats, parts: NDArray[np.int64], out: Floats) -> None:
    """The terms of chunks (chunks, 5), each of the component in `parts`, summed into out (C, 5)."""
    out[:] = 0.0
    for chunk in range(len(parts)):
        for term in range(5):
            out[parts[chunk], term] += terms[chunk, term]


@kernel
def find_pressures(sums: Floats, rest: Floats, shape: Floats, gain: float, out: Floats) -> None:
    """The pressure m in each component, out (C,), that gives its volume back, or `gain` of it.

    From the sums (C, 5) of `volume_terms`, the volumes and areas at rest (C, 2), and the volumes of
    the shape state (C,), which lead the way beyond one: what the shape state lost, gained.
    """
    for part in range(len(out)):
        out[part] = 0.0
        slope, volume = sums[part, 1], rest[part, 0]
        if not slope > 1e-12 * abs(volume):
            continue
        wanted = min(gain, 1.0) * (volume - sums[part, 0])
        if gain > 1.0:
            ratio = min(max(volume / shape[part], 0.25), 4.0) if shape[part] != 0.0 else 1.0
            wanted = volume * ratio ** (0.5 * (gain - 1.0)) - sums[part, 0]
        strain = sums[part, 4] / max(rest[part, 1], _TINY)
        most = _MOST * max(gain, 1.0) * abs(volume) * strain
        wanted = min(max(wanted, -most), most)
        out[part] = _first_root(slope, sums[part, 2], sums[part, 3], wanted)


@kernel
def _first_root(slope: float, curve: float, twist: float, wanted: float) -> float:
    """Where slope m + curve m^2 + twist m^3 is `wanted`, or as near as it comes before it turns."""
    # Beyond here it has lost its slope but for a quarter, and is about to turn.
    lost = 0.75 * slope
    bend = curve if wanted > 0.0 else -curve
    spread = bend * bend - 3.0 * twist * lost
    falling = math.sqrt(spread) - bend if spread > 0.0 else 0.0
    farthest = lost / falling if falling > 0.0 else 4.0 * abs(wanted) / slope
    m = 0.0
    for _ in range(8):
        tangent = slope + m * (2.0 * curve + 3.0 * twist * m)
        m -= (m * (slope + m * (curve + twist * m)) - wanted) / max(tangent, 0.2 * slope)
        m = min(max(m, -farthest), farthest)
    return m
