"""The local step, the global step's right-hand side, and the energy, as compiled kernels.

Positions x (N, 3), rotations (N, 9) row-major; the cells' arrays are those of `solvers.arap_cells`.
Every kernel gives the same bits for any number of threads: blocks of vertices are independent, and
sums are taken in one order.
"""

from __future__ import annotations

import numpy as np
from numba import get_thread_id, prange  # type: ignore[attr-defined]
from numpy.typing import NDArray

from solvers.arap_cells import Cells, Terms
from solvers.compiled import kernel, parallel_kernel
from solvers.laplacian import Floats, Ints
from solvers.rotation_fit import LANES, fit_rotations

_R = 9 * LANES


@kernel
def covariances(  # noqa: PLR0917
    x: Floats, cells: Cells, first: int, size: int, lanes: Floats, laplace_x: Floats
) -> None:
    """The covariances S of `size` cells into rows 0 to 8 of `lanes`; L x into laplace_x.

    Source: Sorkine and Alexa 2007, eq. (5).
    """
    starts, neighbours, fits = cells.starts, cells.neighbours, cells.fits
    for k in range(size):
        i = np.uint64(first + k)
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = 0.0
        l0 = l1 = l2 = 0.0
        for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
            j = np.uint64(neighbours[h])
            d0, d1, d2 = x[j, 0] - x0, x[j, 1] - x1, x[j, 2] - x2
            u0, u1, u2, w = fits[h, 0], fits[h, 1], fits[h, 2], fits[h, 3]
            s0 += d0 * u0
            s1 += d0 * u1
            s2 += d0 * u2
            s3 += d1 * u0
            s4 += d1 * u1
            s5 += d1 * u2
            s6 += d2 * u0
            s7 += d2 * u1
            s8 += d2 * u2
            l0 -= w * d0
            l1 -= w * d1
            l2 -= w * d2
        lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = s0, s1, s2
        lanes[3 * LANES + k], lanes[4 * LANES + k], lanes[5 * LANES + k] = s3, s4, s5
        lanes[6 * LANES + k], lanes[7 * LANES + k], lanes[8 * LANES + k] = s6, s7, s8
        laplace_x[i, 0], laplace_x[i, 1], laplace_x[i, 2] = l0, l1, l2


@parallel_kernel
def fit_cells(x: Floats, cells: Cells, R: Floats, laplace_x: Floats, room: Floats) -> None:
    """The local step: each cell's best rotation into R; L x into laplace_x on the way.

    `room` (threads, SCRATCH) is what each thread works in.

    Source: Sorkine and Alexa 2007, eq. (6).
    """
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes = room[get_thread_id()]
        first = block * LANES
        size = min(LANES, count - first)
        covariances(x, cells, first, size, lanes, laplace_x)
        fit_rotations(lanes, size)
        for k in range(size):
            for entry in range(9):
                R[first + k, entry] = lanes[_R + entry * LANES + k]


@parallel_kernel
def residual(
    R: Floats, laplace_x: Floats, cells: Cells, fixed: NDArray[np.bool_], out: Floats
) -> None:
    """What is left of the global step's equations, out (N, 3) = b(R) - L x; 0 where x is fixed.

    Source: Sorkine and Alexa 2007, eq. (8), for the correction of x in place of x itself.
    """
    starts, neighbours, pulls, own = cells.starts, cells.neighbours, cells.pulls, cells.own
    count = len(out)
    for block in prange((count + LANES - 1) // LANES):
        for first in range(block * LANES, min((block + 1) * LANES, count)):
            i = np.uint64(first)
            if fixed[i]:
                out[i, 0] = out[i, 1] = out[i, 2] = 0.0
                continue
            v0, v1, v2 = own[i, 0], own[i, 1], own[i, 2]
            b0 = R[i, 0] * v0 + R[i, 1] * v1 + R[i, 2] * v2 - laplace_x[i, 0]
            b1 = R[i, 3] * v0 + R[i, 4] * v1 + R[i, 5] * v2 - laplace_x[i, 1]
            b2 = R[i, 6] * v0 + R[i, 7] * v1 + R[i, 8] * v2 - laplace_x[i, 2]
            for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
                j = np.uint64(neighbours[h])
                v0, v1, v2 = pulls[h, 0], pulls[h, 1], pulls[h, 2]
                b0 += R[j, 0] * v0 + R[j, 1] * v1 + R[j, 2] * v2
                b1 += R[j, 3] * v0 + R[j, 4] * v1 + R[j, 5] * v2
                b2 += R[j, 6] * v0 + R[j, 7] * v1 + R[j, 8] * v2
            out[i, 0], out[i, 1], out[i, 2] = b0, b1, b2


@kernel
def pull_soft(places: Ints, stiffness: Floats, goals: Floats, x: Floats, out: Floats) -> None:
    """Add to out (N, 3) what springs to goals (H, 3) pull at x; `stiffness` is by vertex (N,).

    Source: Celikcan et al. 2015, eq. (3).
    """
    for h in range(len(places)):
        v = places[h]
        k = stiffness[v]
        out[v, 0] += k * (goals[h, 0] - x[v, 0])
        out[v, 1] += k * (goals[h, 1] - x[v, 1])
        out[v, 2] += k * (goals[h, 2] - x[v, 2])


@parallel_kernel
def energy_terms(x: Floats, R: Floats, rest: Floats, terms: Terms, out: Floats) -> None:
    """Each term w |e' - R e|^2 of the energy, without cancellation, out (T,).

    Source: Sorkine and Alexa 2007, eq. (7); Chao et al. 2010, section 4.
    """
    for t in prange(len(terms.cells)):
        a, b, c = terms.tails[t], terms.heads[t], terms.cells[t]
        e0, e1, e2 = rest[a, 0] - rest[b, 0], rest[a, 1] - rest[b, 1], rest[a, 2] - rest[b, 2]
        d0 = x[a, 0] - x[b, 0] - (R[c, 0] * e0 + R[c, 1] * e1 + R[c, 2] * e2)
        d1 = x[a, 1] - x[b, 1] - (R[c, 3] * e0 + R[c, 4] * e1 + R[c, 5] * e2)
        d2 = x[a, 2] - x[b, 2] - (R[c, 6] * e0 + R[c, 7] * e1 + R[c, 8] * e2)
        out[t] = terms.weights[t] * (d0 * d0 + d1 * d1 + d2 * d2)


@kernel
def place_outside(x: Floats, order: Ints, centre: Floats, size: float, out: Floats) -> None:
    """Vertex order[i] of out (N, 3) is x[i] times the size, plus the centre (3,)."""
    for i in range(len(order)):
        v = order[i]
        out[v, 0] = x[i, 0] * size + centre[0]
        out[v, 1] = x[i, 1] * size + centre[1]
        out[v, 2] = x[i, 2] * size + centre[2]
