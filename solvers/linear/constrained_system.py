"""The linear system of the global step: a surface's Laplacian with constraints that may change.

Every vertex is an unknown, constrained or not, so that the order of elimination and the blocks of
the factor are made once (Celikcan et al. 2015, section 4, reuse the permutation in the same way).
The row and column of a fixed vertex are cleared except for the diagonal; a spring adds its
stiffness to the diagonal. When constraints change, only the numbers are factored again, and only
in the subtrees where they change.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.linear.block_factor import BlockFactor
from solvers.linear.blocks import Entries
from solvers.linear.laplacian import Floats, Ints
from solvers.linear.nested_dissection import Dissection

Bools = NDArray[np.bool_]


class Constraints(NamedTuple):
    """The constraints of N vertices.

    Attributes:
        fixed: (N,) bool, vertices whose correction is zero.
        stiffness: (N,) of the spring that pulls each vertex to its target, 0 for none.
    """

    fixed: Bools
    stiffness: Floats


class ConstrainedSystem:
    """A Laplacian (N, N) in the order of a dissection, factored with its constraints.

    Attributes:
        constraints: the present ones.
    """

    def __init__(
        self, laplacian: sp.csr_matrix, tree: Dissection, constraints: Constraints
    ) -> None:
        matrix = laplacian.sorted_indices()
        self._entries = Entries(
            matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), matrix.data
        )
        self.constraints = constraints
        values = _constrained_values(self._entries, constraints)
        system = sp.csr_matrix((values, matrix.indices, matrix.indptr), shape=matrix.shape)
        self._factor = BlockFactor(system, tree)

    def constrain(self, constraints: Constraints) -> None:
        """Replace the constraints and factor again."""
        self.constraints = constraints
        self._factor.refactor(_constrained_values(self._entries, constraints))

    @property
    def precision(self) -> np.dtype[Any]:
        """The type of the factor's numbers; earlier constraints may have decided it."""
        return self._factor.precision

    def restore(self, constraints: Constraints, precision: np.dtype[Any]) -> None:
        """Take the constraints of an earlier time, when the factor had this precision."""
        self.constraints = constraints
        self._factor.restore(_constrained_values(self._entries, constraints), precision)

    def add_solution(self, b: Floats, x: Floats) -> None:
        """Add to x (N, 3) the solution for the right-hand side b (N, 3)."""
        self._factor.add_solution(b, x)

    def harmonic(self, group_at: Ints, first: int, out: Floats) -> None:
        """Put the shares of groups first, first + 1, first + 2 in each vertex into out (N, 3).

        A group's share (N,) is harmonic, one at the group's fixed vertices and zero at those of
        other groups; `group_at` (N,) is the group at each vertex, or -1. The shares of all groups
        sum to one.

        Source: Joshi et al. 2007, Harmonic coordinates for character articulation, section 3.
        """
        b = np.empty_like(out)
        _pulls_of_groups(self._entries, self.constraints, group_at, first, b)
        self._factor.solve(b, out)

    @property
    def nbytes(self) -> int:
        """The bytes that a solve reads of the factor."""
        return self._factor.nbytes


@kernel
def _constrained_values(laplacian: Entries, constraints: Constraints) -> Floats:
    """The values of the constrained matrix."""
    starts, columns = laplacian.starts, laplacian.columns
    fixed, stiffness = constraints.fixed, constraints.stiffness
    values = laplacian.values.copy()
    for v in range(len(fixed)):
        for h in range(starts[v], starts[v + 1]):
            u = columns[h]
            if u == v:
                values[h] = 1.0 if fixed[v] else values[h] + stiffness[v]
            elif fixed[v] or fixed[u]:
                values[h] = 0.0
    return values


@kernel
def _pulls_of_groups(
    laplacian: Entries, constraints: Constraints, group_at: Ints, first: int, out: Floats
) -> None:
    """The right-hand sides of three groups' shares, out (N, 3)."""
    starts, columns, values = laplacian.starts, laplacian.columns, laplacian.values
    fixed, stiffness = constraints.fixed, constraints.stiffness
    for v in range(len(fixed)):
        out[v, 0] = out[v, 1] = out[v, 2] = 0.0
        own = group_at[v] - first
        if 0 <= own < 3:
            out[v, own] = 1.0 if fixed[v] else stiffness[v]
        if not fixed[v]:
            for h in range(starts[v], starts[v + 1]):
                u = columns[h]
                group = group_at[u] - first
                if fixed[u] and 0 <= group < 3:
                    out[v, group] -= values[h]
