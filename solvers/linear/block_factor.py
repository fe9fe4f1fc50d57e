"""A sparse factor made for many solves with three right-hand sides.

The elimination tree of a nested dissection is factored block by block, as A = L D L^T with dense
blocks (`solvers.linear.factorisation`). Each pivot block is inverted and each block of L multiplied
by it, so that a solve is one dense product per block on the way up the tree and one on the way down
(`solvers.linear.substitution`). The factor is computed in double and kept in single precision,
which halves what a solve must read; a residual in double precision makes up for it (Carson and
Higham 2018, Accelerating the solution of linear systems by iterative refinement in three
precisions). The factor of a matrix so badly conditioned that this does not suffice is kept in
double precision.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.kernels.compiled import one_blas_thread
from solvers.linear.blocks import Entries, Panels, Values, Workspace
from solvers.linear.factorisation import factorise, stale_tasks
from solvers.linear.laplacian import Floats
from solvers.linear.nested_dissection import Dissection
from solvers.linear.substitution import add_solution
from solvers.linear.symbolic import plan_blocks

# The share of an error that a solve in single precision may leave.
_LOST_MOST = 1e-2


class BlockFactor:
    """A factored symmetric positive definite matrix (n, n), given in the order of a dissection."""

    def __init__(self, matrix: sp.csr_matrix, tree: Dissection) -> None:
        self._matrix = matrix.sorted_indices()
        starts, columns = self._matrix.indptr.astype(np.int32), self._matrix.indices
        self._entries = Entries(starts, columns.astype(np.int32), self._matrix.data)
        self._blocks, self._schedule, self._updates = plan_blocks(self._entries, tree)
        self._fill(np.dtype(np.float32))

    def refactor(self, values: Floats) -> None:
        """Take other values for the matrix's entries, in the order of its compressed rows.

        The order and the blocks stay. Subtrees whose entries are the same are not computed again.
        """
        stale = stale_tasks(self._entries, values, self._blocks, self._schedule)
        self._entries.values[:] = values
        with one_blas_thread():
            self._factorise(stale)
            self._check(rounds=1)

    def restore(self, values: Floats, precision: np.dtype[Any]) -> None:
        """Factor these values as `refactor` does, in the precision of an earlier time.

        The precision is not tested again: it depends on all values since the first.
        """
        stale = stale_tasks(self._entries, values, self._blocks, self._schedule)
        self._entries.values[:] = values
        if precision != self.precision:
            self._allocate(precision)
            stale[:] = True
        with one_blas_thread():
            self._factorise(stale)

    def add_solution(self, b: Floats, x: Floats) -> None:
        """Add the solution y of A y = b, both (n, 3), to the first n rows of x."""
        add_solution(self._blocks, self._panels, self._schedule, b, x, self._workspace)

    def solve(self, b: Floats, x: Floats) -> None:
        """Put the solution of A x = b, both (n, 3), into x."""
        x[:] = 0.0
        self.add_solution(b, x)

    @property
    def precision(self) -> np.dtype[Any]:
        """The type of the factor's numbers."""
        return self._panels.ups.dtype

    @property
    def nbytes(self) -> int:
        """The bytes that a solve reads of the factor."""
        return self._panels.ups.nbytes + self._panels.downs.nbytes + 2 * self._blocks.reach.nbytes

    def _allocate(self, precision: np.dtype[Any]) -> None:
        """Make panels and a workspace of one precision."""
        blocks, schedule = self._blocks, self._schedule
        ups = np.zeros(blocks.up_starts[-1], precision)
        self._panels = Panels(ups, np.zeros(blocks.down_starts[0], precision))
        tasks = len(schedule.task_firsts)
        self._workspace = Workspace(
            np.zeros((self._matrix.shape[0] + tasks * len(schedule.shared), 3), precision),
            np.zeros((tasks + 1, 3, schedule.widest), precision),
        )

    def _fill(self, precision: np.dtype[Any]) -> None:
        """Compute all panels in one precision."""
        self._allocate(precision)
        with one_blas_thread():
            self._factorise(np.ones(len(self._schedule.task_firsts), np.bool_))
            self._check(rounds=3)

    def _factorise(self, stale: NDArray[np.bool_]) -> None:
        """Compute the panels of stale tasks (tasks,) and of the blocks above."""
        if self.precision == np.float64:
            values = Values(Panels(*np.zeros((2, 0), np.float32)), self._panels)
        else:
            values = Values(self._panels, Panels(*np.zeros((2, 0))))
        factorise(self._entries, stale, self._blocks, values, self._schedule, self._updates)

    def _check(self, rounds: int) -> None:
        """Go over to double precision, for good, where single precision loses too much."""
        if self.precision == np.float64:
            return
        if _lost_share(self._matrix, self, rounds) > _LOST_MOST:
            self._fill(np.dtype(np.float64))


@lru_cache(maxsize=8)
def _probe(count: int) -> Floats:
    """A fixed error (n, 3) to solve for."""
    return np.random.default_rng(0).standard_normal((count, 3))


def _lost_share(matrix: sp.csr_matrix, factor: BlockFactor, rounds: int) -> float:
    """The share of an error, in the matrix's norm, that a solve leaves; the worst of some rounds.

    A step that corrects by this solve descends on the quadratic form as long as the share is below
    one. Each round starts from the error that the last one left, which the solve is worst at.
    """
    error = _probe(matrix.shape[0]).copy()
    found = np.empty_like(error)
    worst = 0.0
    for _ in range(rounds):
        image = matrix @ error
        before = float(np.vdot(error, image))
        if not before > 0.0:
            break
        factor.solve(image, found)
        error -= found
        after = float(np.vdot(error, matrix @ error))
        share = math.sqrt(max(after, 0.0) / before)
        worst = max(worst, share if math.isfinite(share) else math.inf)
        error /= math.sqrt(after) if 0.0 < after < math.inf else 1.0
    return worst
