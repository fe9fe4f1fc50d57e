"""Energy terms between the rotations of cells: smooth rotations, and limbs that stay stiff.

In plain ARAP the rotations of the cells are independent. Two terms may be added to its energy, with
M the mass of a cell at rest (its edges' w |e|^2), A the surface's area, w the edges' weights:

- smooth rotations, a A sum over half-edges (k, l) of w |R_k - R_l|^2: bending spreads evenly,
  however fine the mesh and however few the handles (Levi and Gotsman 2015, Smooth rotation enhanced
  as-rigid-as-possible mesh animation);
- stiff segments, c s / (1 - s) sum over cells of M_k r_k |R_k - Q_region(k)|^2: every region has
  one rotation Q, and its cells stay near Q where their rigidity r is one. So limbs stay straight
  and joints bend (Celikcan et al. 2015, section 8, name it as future work).

For rotations |R - B|^2 = 6 - 2 <R, B>. So each cell fits S_k + P_k, with a prior P_k, in place of
its covariance S_k, and the matrix of the global step stays the same. No local step raises the
energy:

- |R_k - R_l|^2 <= 2 |R_k - B|^2 + 2 |R_l - B|^2 for any B, with equality where B is their mean.
  With the mean of the last rotations as B, all cells can be fitted independently.
- A region's Q is the rotation nearest to its cells' current rotations.
- After the fit each region turns as a whole, its cells and its Q together, by the rotation that
  lowers the energy most. Without this step Q would hold back each cell, and a common turn would
  need many steps.

Rotations with these terms must start from those of the last frame. They move along with the handles
as positions do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import get_thread_id, prange  # type: ignore[attr-defined]  # numba exports it untyped
from numpy.typing import NDArray

from solvers.deform.arap_cells import CellMesh, Cells
from solvers.deform.arap_kernels import covariances
from solvers.deform.handle_motion import KEPT, Influences
from solvers.deform.rotation_fit import LANES, SCRATCH, fit_rotations
from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.linear.laplacian import Floats, Ints

SMOOTHNESS = 0.02  # Levi and Gotsman's alpha
HALF = 0.05  # c: stiffness 1/2 about halves the bend of a limb between its joints (measured)

_R = 9 * LANES

NO_PRIORS: Floats = np.zeros((0, 9))


class Regions(NamedTuple):
    """A partition of N cells: the region of each, and the members (N,) of each from `starts`."""

    of_cell: Ints
    members: Ints
    starts: Ints

    @classmethod
    def by_label(cls, labels: Ints) -> Regions:
        """Return the partition with regions 0, 1, ... given by `labels` (N,)."""
        members = np.argsort(labels, kind="stable").astype(np.int64)
        starts = np.searchsorted(labels[members], np.arange(int(labels.max(initial=0)) + 2))
        return cls(np.ascontiguousarray(labels, dtype=np.int64), members, starts.astype(np.int64))


class RotationPriors:
    """The energy terms between the rotations R (N, 9) of a surface's cells.

    Args:
        mesh: the cells at rest.
        rest: (N, 3) rest positions.
        smoothing: a A of the module's energy, 0 for none.

    Attributes:
        stiffness: s of the module's energy, in [0, 1); without an effect before `stiffen`.
    """

    def __init__(self, mesh: CellMesh, rest: Floats, smoothing: float) -> None:
        self._cells = cells = mesh.cells
        self._sharing = mesh.sharing
        self._smoothing = smoothing
        self._masses = _masses(cells, rest)
        self.stiffness = 0.0
        self._regions: Regions | None = None
        self._rigid_masses = np.zeros(0)
        self._Q = np.zeros((0, 9))
        self._room: Floats = NO_PRIORS
        self._terms = np.zeros(0)

    @property
    def is_on(self) -> bool:
        """Whether any term has an effect."""
        return self._smoothing > 0.0 or self._is_stiff

    @property
    def _is_stiff(self) -> bool:
        return self.stiffness > 0.0 and self._regions is not None

    def stiffen(self, region_of: Ints, rigidity: Floats) -> None:
        """Set the region (N,) and the rigidity (N,) in [0, 1] of each cell."""
        _, labels = np.unique(region_of, return_inverse=True)
        self._regions = Regions.by_label(labels)
        self._rigid_masses = self._masses * rigidity
        self._Q = np.empty((len(self._regions.starts) - 1, 9))

    def find(self, R: Floats) -> Floats:
        """Return the priors (N, 9) of the next fit, given the rotations; (0, 9) without a term."""
        if not self.is_on:
            return NO_PRIORS
        if len(self._room) != len(R):
            self._room, self._twists = np.empty_like(R), np.empty_like(R)
            self._ones = np.ones(len(R))
        smooth_priors(R, self._cells, self._smooth_share, self._room)
        if self._is_stiff:
            regions, masses = self._stiff
            nearest_rotations(R, regions, masses, self._Q)
            add_region_priors(self._Q, regions.of_cell, masses, self._kappa, self._room)
        return self._room

    def turn_regions(self, S: Floats, R: Floats) -> None:
        """After a fit with covariances S (N, 9), turn every region as a whole."""
        if self._is_stiff:
            regions, _ = self._stiff
            twists(S, R, self._cells, self._smooth_share, regions.of_cell, self._twists)
            nearest_rotations(self._twists, regions, self._ones, self._Q)
            turn_each(self._Q, regions.of_cell, R)

    def energy(self, R: Floats) -> float:
        """Return the energy of the terms for cells with rotations R (N, 9)."""
        total = 0.0
        if self.is_on and len(self._terms) != len(R):
            self._terms = np.empty(len(R))
        if self._smoothing > 0.0:
            roughness(R, self._cells, self._terms)
            total += self._smoothing * float(self._terms.sum())
        if self._is_stiff:
            regions, masses = self._stiff
            nearest_rotations(R, regions, masses, self._Q)
            unevenness(R, self._Q, regions.of_cell, masses, self._terms)
            total += self._kappa * self._sharing * float(self._terms.sum())
        return total

    @property
    def _stiff(self) -> tuple[Regions, Floats]:
        assert self._regions is not None
        return self._regions, self._rigid_masses

    @property
    def _smooth_share(self) -> float:
        """The factor of w (R_k + R_l) in a prior: E is -2 sharing <R, S + P> plus a constant."""
        return 2.0 * self._smoothing / self._sharing

    @property
    def _kappa(self) -> float:
        return HALF * self.stiffness / (1.0 - self.stiffness)


def _masses(cells: Cells, rest: Floats) -> Floats:
    """The trace of each cell's covariance at rest, (N,): M over the number of cells at an edge."""
    count = len(rest)
    owner = np.repeat(np.arange(count), np.diff(cells.starts).astype(np.int64))
    edges = rest[cells.neighbours] - rest[owner]
    traces = np.einsum("hk,hk->h", edges, cells.fits[:, :3])
    return np.maximum(np.bincount(owner, traces, minlength=count), 0.0)


@kernel
def add_priors(lanes: Floats, priors: Floats, first: int, size: int) -> None:
    """Add the priors (N, 9) of `size` cells to their covariances, rows 0 to 8 of `lanes`."""
    for k in range(size):
        for entry in range(9):
            lanes[entry * LANES + k] += priors[first + k, entry]


@kernel
def leave_covariances(lanes: Floats, priors: Floats, first: int, size: int) -> None:
    """Subtract the priors from `lanes` again, and replace the priors by the covariances."""
    for k in range(size):
        for entry in range(9):
            S = lanes[entry * LANES + k] - priors[first + k, entry]
            lanes[entry * LANES + k] = priors[first + k, entry] = S


@parallel_kernel
def fit_cells_near(
    x: Floats, cells: Cells, priors: Floats, R: Floats, laplace_x: Floats, room: Floats
) -> None:
    """`solvers.deform.arap_kernels.fit_cells` with priors (N, 9), which S then replaces."""
    count = len(cells.starts) - 1
    for block in prange((count + LANES - 1) // LANES):
        lanes = room[get_thread_id()]
        first = block * LANES
        size = min(LANES, count - first)
        covariances(x, cells, first, size, lanes, laplace_x)
        add_priors(lanes, priors, first, size)
        fit_rotations(lanes, size)
        leave_covariances(lanes, priors, first, size)
        for k in range(size):
            for entry in range(9):
                R[first + k, entry] = lanes[_R + entry * LANES + k]


@parallel_kernel
def smooth_priors(R: Floats, cells: Cells, factor: float, out: Floats) -> None:
    """The smoothness prior of each cell, out (N, 9): factor times the sum of w (R_k + R_l).

    A weight below zero, which a rim's obtuse angle may cause, counts as zero: it would drive the
    rotations apart.
    """
    starts, neighbours, fits = cells.starts, cells.neighbours, cells.fits
    for index in prange(len(R)):
        i = np.uint64(index)
        total = 0.0
        p0 = p1 = p2 = p3 = p4 = p5 = p6 = p7 = p8 = 0.0
        if factor > 0.0:
            for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
                j = np.uint64(neighbours[h])
                w = max(fits[h, 3], 0.0)
                total += w
                p0, p1, p2 = p0 + w * R[j, 0], p1 + w * R[j, 1], p2 + w * R[j, 2]
                p3, p4, p5 = p3 + w * R[j, 3], p4 + w * R[j, 4], p5 + w * R[j, 5]
                p6, p7, p8 = p6 + w * R[j, 6], p7 + w * R[j, 7], p8 + w * R[j, 8]
        out[i, 0] = factor * (p0 + total * R[i, 0])
        out[i, 1] = factor * (p1 + total * R[i, 1])
        out[i, 2] = factor * (p2 + total * R[i, 2])
        out[i, 3] = factor * (p3 + total * R[i, 3])
        out[i, 4] = factor * (p4 + total * R[i, 4])
        out[i, 5] = factor * (p5 + total * R[i, 5])
        out[i, 6] = factor * (p6 + total * R[i, 6])
        out[i, 7] = factor * (p7 + total * R[i, 7])
        out[i, 8] = factor * (p8 + total * R[i, 8])


@parallel_kernel
def roughness(R: Floats, cells: Cells, out: Floats) -> None:
    """The sum of w |R_k - R_l|^2 over each cell's half-edges, out (N,)."""
    starts, neighbours, fits = cells.starts, cells.neighbours, cells.fits
    for index in prange(len(R)):
        i = np.uint64(index)
        total = 0.0
        for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
            j = np.uint64(neighbours[h])
            square = 0.0
            for entry in range(9):
                difference = R[i, entry] - R[j, entry]
                square += difference * difference
            total += max(fits[h, 3], 0.0) * square
        out[i] = total


@parallel_kernel
def nearest_rotations(R: Floats, regions: Regions, weights: Floats, out: Floats) -> None:
    """The rotation nearest to each region's weighted matrices R (N, 9), out (G, 9)."""
    members, starts = regions.members, regions.starts
    for region in prange(len(out)):
        lanes = np.zeros(SCRATCH)
        for m in range(starts[region], starts[region + 1]):
            i = members[m]
            for entry in range(9):
                lanes[entry * LANES] += weights[i] * R[i, entry]
        fit_rotations(lanes, 1)
        for entry in range(9):
            out[region, entry] = lanes[_R + entry * LANES]


@parallel_kernel
def add_region_priors(
    Q: Floats, region_of: Ints, rigid_masses: Floats, kappa: float, out: Floats
) -> None:
    """Add the stiffness prior of each cell to out (N, 9): its region's Q (G, 9), weighted."""
    for i in prange(len(out)):
        weight, region = kappa * rigid_masses[i], region_of[i]
        for entry in range(9):
            out[i, entry] += weight * Q[region, entry]


@parallel_kernel
def unevenness(R: Floats, Q: Floats, region_of: Ints, rigid_masses: Floats, out: Floats) -> None:
    """The stiffness energy of each cell, out (N,): its mass times |R_k - Q|^2."""
    for i in prange(len(R)):
        square, region = 0.0, region_of[i]
        for entry in range(9):
            difference = R[i, entry] - Q[region, entry]
            square += difference * difference
        out[i] = rigid_masses[i] * square


@parallel_kernel
def twists(S: Floats, R: Floats, cells: Cells, factor: float, region_of: Ints, out: Floats) -> None:
    """Each cell's term of its region's common rotation, out (N, 9): (S_k + P_k) R_k^T.

    The prior P_k counts only cells of other regions: cells of the same region turn with it.
    """
    starts, neighbours, fits = cells.starts, cells.neighbours, cells.fits
    for index in prange(len(R)):
        i = np.uint64(index)
        a0, a1, a2, a3, a4 = S[i, 0], S[i, 1], S[i, 2], S[i, 3], S[i, 4]
        a5, a6, a7, a8 = S[i, 5], S[i, 6], S[i, 7], S[i, 8]
        if factor > 0.0:
            total = 0.0
            for h in range(np.uint64(starts[i]), np.uint64(starts[i + np.uint64(1)])):
                j = np.uint64(neighbours[h])
                if region_of[j] == region_of[i]:
                    continue
                w = factor * max(fits[h, 3], 0.0)
                total += w
                a0, a1, a2 = a0 + w * R[j, 0], a1 + w * R[j, 1], a2 + w * R[j, 2]
                a3, a4, a5 = a3 + w * R[j, 3], a4 + w * R[j, 4], a5 + w * R[j, 5]
                a6, a7, a8 = a6 + w * R[j, 6], a7 + w * R[j, 7], a8 + w * R[j, 8]
            a0, a1, a2 = a0 + total * R[i, 0], a1 + total * R[i, 1], a2 + total * R[i, 2]
            a3, a4, a5 = a3 + total * R[i, 3], a4 + total * R[i, 4], a5 + total * R[i, 5]
            a6, a7, a8 = a6 + total * R[i, 6], a7 + total * R[i, 7], a8 + total * R[i, 8]
        for column in range(3):
            r0, r1, r2 = R[i, 3 * column], R[i, 3 * column + 1], R[i, 3 * column + 2]
            out[i, column] = a0 * r0 + a1 * r1 + a2 * r2
            out[i, 3 + column] = a3 * r0 + a4 * r1 + a5 * r2
            out[i, 6 + column] = a6 * r0 + a7 * r1 + a8 * r2


@parallel_kernel
def turn_each(turns: Floats, region_of: Ints, R: Floats) -> None:
    """Turn each rotation (N, 9) by that of its region (G, 9)."""
    for i in prange(len(R)):
        c = region_of[i]
        for column in range(3):
            r0, r1, r2 = R[i, column], R[i, 3 + column], R[i, 6 + column]
            R[i, column] = turns[c, 0] * r0 + turns[c, 1] * r1 + turns[c, 2] * r2
            R[i, 3 + column] = turns[c, 3] * r0 + turns[c, 4] * r1 + turns[c, 5] * r2
            R[i, 6 + column] = turns[c, 6] * r0 + turns[c, 7] * r1 + turns[c, 8] * r2


def turn_along(R: Floats, influences: Influences, motions: Floats) -> None:
    """Turn rotations (N, 9) with the motions (G, 8) that their cells follow."""
    _turn_along(R, influences.groups, influences.weights, motions)


@parallel_kernel
def _turn_along(R: Floats, groups: NDArray[np.uint32], weights: Floats, motions: Floats) -> None:
    """The rotation of `solvers.deform.handle_motion.move_along`, for R in place of x."""
    for i in prange(len(R)):
        first = groups[i, 0]
        w = a = b = c = 0.0
        for k in range(KEPT):
            g = groups[i, k]
            along = 0.0
            for entry in range(4):
                along += motions[g, entry] * motions[first, entry]
            m = -weights[i, k] if along < 0.0 else weights[i, k]
            w, a = w + m * motions[g, 0], a + m * motions[g, 1]
            b, c = b + m * motions[g, 2], c + m * motions[g, 3]
        s = 2.0 / (w * w + a * a + b * b + c * c)
        for column in range(3):
            r0, r1, r2 = R[i, column], R[i, 3 + column], R[i, 6 + column]
            c0, c1, c2 = (
                b * r2 - c * r1 + w * r0,
                c * r0 - a * r2 + w * r1,
                a * r1 - b * r0 + w * r2,
            )
            R[i, column] = r0 + s * (b * c2 - c * c1)
            R[i, 3 + column] = r1 + s * (c * c0 - a * c2)
            R[i, 6 + column] = r2 + s * (a * c1 - b * c0)
