"""Compiled kernels of ARAP: the local step, the global step's right-hand side, and the energy.

Positions x are (N, 3), rotations (N, 9) row-major; the cells' arrays are those of
`solvers.deform.arap_cells`. Every kernel returns the same bits for any number of threads: blocks of
vertices are independent, and every sum has one order.
"""

from __future__ import annotations

import numpy as np
from numba import get_thread_id, prange  # type: ignore[attr-defined]  # numba exports it untyped
from numpy.typing import NDArray

from solvers.deform.arap_cells import Cells, Terms
from solvers.deform.rotation_fit import LANES, fit_rotations
from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.kernels.vectors import lane, load, load_row, repeat_three, zeros
from solvers.linear.laplacian import Floats, Ints

_R = 9 * LANES
_ENTRIES = np.uint64(9)  # of a rotation


@kernel
def covariances(
    x: Floats, cells: Cells, first: int, size: int, lanes: Floats, laplace_x: Floats
) -> None:
    """Write the covariances S of `size` cells to rows 0 to 8 of `lanes`, and L x to laplace_x.

    Source: Sorkine and Alexa 2007, eq. (5).
    """
    starts, neighbours, fits = cells.starts, cells.neighbours, cells.fits
    for k in range(size):
        i = np.uint64(first + k)
        here = load_row(x, i)
        column0, column1, column2 = zeros(x, 4), zeros(x, 4), zeros(x, 4)
        image = zeros(x, 4)
        for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
            edge = load_row(x, neighbours[h]) - here
            column0 += edge * fits[h, 0]
            column1 += edge * fits[h, 1]
            column2 += edge * fits[h, 2]
            image -= edge * fits[h, 3]
        lanes[k], lanes[3 * LANES + k] = lane(column0, 0), lane(column0, 1)
        lanes[6 * LANES + k], lanes[LANES + k] = lane(column0, 2), lane(column1, 0)
        lanes[4 * LANES + k], lanes[7 * LANES + k] = lane(column1, 1), lane(column1, 2)
        lanes[2 * LANES + k], lanes[5 * LANES + k] = lane(column2, 0), lane(column2, 1)
        lanes[8 * LANES + k] = lane(column2, 2)
        laplace_x[i, 0], laplace_x[i, 1], laplace_x[i, 2] = (
            lane(image, 0),
            lane(image, 1),
            lane(image, 2),
        )


@parallel_kernel
def fit_cells(x: Floats, cells: Cells, R: Floats, laplace_x: Floats, room: Floats) -> None:
    """The local step: write each cell's best rotation to R (N, 9), and L x to laplace_x (N, 3).

    `room` (threads, SCRATCH) is each thread's scratch space.

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
            i = np.uint64(first + k)
            for entry in range(9):
                R[i, entry] = lanes[_R + entry * LANES + k]


@parallel_kernel
def residual(
    R: Floats, laplace_x: Floats, cells: Cells, fixed: NDArray[np.bool_], out: Floats
) -> None:
    """The residual of the global step, out (N, 3) = b(R) - L x; 0 where x is fixed.

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
            # Eight products of entries of R and of a vector at once, then the ninth.
            turned = load(R, i * _ENTRIES, 8) * repeat_three(load_row(own, i))
            last = R[i, 8] * own[i, 2]
            for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
                j = np.uint64(neighbours[h])
                turned += load(R, j * _ENTRIES, 8) * repeat_three(load_row(pulls, h))
                last += R[j, 8] * pulls[h, 2]
            out[i, 0] = lane(turned, 0) + lane(turned, 1) + lane(turned, 2) - laplace_x[i, 0]
            out[i, 1] = lane(turned, 3) + lane(turned, 4) + lane(turned, 5) - laplace_x[i, 1]
            out[i, 2] = lane(turned, 6) + lane(turned, 7) + last - laplace_x[i, 2]


@kernel
def pull_soft(places: Ints, stiffness: Floats, goals: Floats, x: Floats, out: Floats) -> None:
    """Add the pull of springs from x to goals (H, 3) to out (N, 3); `stiffness` is by vertex (N,).

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
    """Write each term w |e' - R e|^2 of the energy to out (T,), without cancellation.

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
    """Set vertex order[i] of out (N, 3) to x[i] times the size, plus the centre (3,)."""
    for i in range(len(order)):
        v = order[i]
        out[v, 0] = x[i, 0] * size + centre[0]
        out[v, 1] = x[i, 1] * size + centre[1]
        out[v, 2] = x[i, 2] * size + centre[2]
