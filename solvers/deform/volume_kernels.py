"""Compiled kernels that measure the volume of closed surfaces and find the pressure to restore it.

Positions x are (N, 3), in the solver's order.

Source: Celikcan, Yaz and Capin 2015, section 4; see `solvers.squash_stretch` for the pressure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.kernels.vector import cross, dot
from solvers.linear.laplacian import Floats

# The most volume that a pressure may restore, as a multiple of the component's mean strain times
# its volume. A bend loses volume too, which must not be pumped into the few squashed cells.
_MOST = 3.0

_TINY = 1e-300


class ClosedShells(NamedTuple):
    """The closed surfaces whose volumes are kept; a named tuple, because kernels accept those.

    Faces (F, 3) are ordered by component and include fans over holes, which have area 0. Chunk c
    holds the faces from `chunks[c]` to `chunks[c + 1]`, all of component `parts[c]`; its volume is
    measured from vertex `origins[c]`. The `pairs` (3 F', 2) from `corners[i]` to `corners[i + 1]`
    are the other two vertices of each face at vertex i, in order, without the fans.
    """

    faces: NDArray[np.uint32]
    areas: Floats
    chunks: NDArray[np.int64]
    parts: NDArray[np.int64]
    origins: NDArray[np.uint32]
    corners: NDArray[np.uint32]
    pairs: NDArray[np.uint32]


@parallel_kernel
def strain_cells(scales: Floats, out: Floats) -> None:
    """The strain of each cell, |s - 1/s| / 2, out (N,)."""
    for i in prange(len(out)):
        out[i] = 0.5 * abs(scales[i] - 1.0 / scales[i])


@parallel_kernel
def push(
    x: Floats, shell: ClosedShells, strains: Floats, fixed: NDArray[np.bool_], out: Floats
) -> None:
    """The direction in which a pressure moves each vertex, out (N, 3): area vector times strain.

    An area vector is the gradient of the volume. Fixed vertices do not move.
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
def volume_terms(x: Floats, g: Floats, shell: ClosedShells, strains: Floats, out: Floats) -> None:
    """The part of each chunk in its component's volume, out (chunks, 5).

    Columns 0 to 3 are the volume of x + m g as a polynomial in m, constant first; column 4 is the
    sum of the cells' strains times their rest areas.
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
            qr, vw = cross(q, r), cross(v, w)
            mixed = cross(q, w), cross(v, r)
            t0 += dot(p, qr)
            t1 += dot(u, qr) + dot(p, mixed[0]) + dot(p, mixed[1])
            t2 += dot(p, vw) + dot(u, mixed[0]) + dot(u, mixed[1])
            t3 += dot(u, vw)
            strained += areas[face] * (strains[i] + strains[j] + strains[k])
        out[chunk, 0], out[chunk, 1], out[chunk, 2] = t0 / 6.0, t1 / 6.0, t2 / 6.0
        out[chunk, 3], out[chunk, 4] = t3 / 6.0, strained / 3.0


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
    """Sum the terms of chunks (chunks, 5) by component; `parts` names each chunk's; out (C, 5)."""
    out[:] = 0.0
    for chunk in range(len(parts)):
        for term in range(5):
            out[parts[chunk], term] += terms[chunk, term]


@kernel
def find_pressures(sums: Floats, rest: Floats, shape: Floats, gain: float, out: Floats) -> None:
    """The pressure m in each component, out (C,), that restores the share `gain` of its volume.

    Args:
        sums: (C, 5) of `volume_terms`.
        rest: (C, 2) volumes and areas at rest.
        shape: (C,) volumes of the shape state. A gain above 1 adds volume in proportion to the
            volume that the shape state lost.
        gain: the share of the lost volume.
        out: (C,).
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
    """The m where slope m + curve m^2 + twist m^3 is `wanted`, or nearest before its extremum."""
    # At `farthest` only a quarter of the slope is left, so the extremum is near.
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
