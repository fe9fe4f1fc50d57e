"""The linear system of the global step: a surface's Laplacian, held by handles that come and go.

Every vertex is an unknown, whatever holds it, so that the order of elimination and the blocks of
the factor are made once (Celikcan et al. 2015, section 4, reuse the permutation in the same way).
A vertex that is fixed has its row and column cleared but for the diagonal; a soft handle adds its
stiffness to the diagonal. When handles change, only the numbers are factored again, and of those
only the subtrees that are concerned.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.linear.block_factor import BlockFactor, Entries
from solvers.linear.laplacian import Floats, Ints
from solvers.linear.nested_dissection import Dissection

Bools = NDArray[np.bool_]


class Hold(NamedTuple):
    """What holds N vertices.

    Attributes:
        fixed: (N,) bool, whose correction is zero.
        stiffness: (N,) of the spring that pulls each to its target, 0 for none.
    """

    fixed: Bools
    stiffness: Floats


class ConstrainedSystem:
    """A Laplacian (N, N) in the order of a dissection, factored with what holds it.

    Attributes:
        held: what holds it.
    """

    def __init__(self, laplacian: sp.csr_matrix, tree: Dissection, held: Hold) -> None:
        matrix = laplacian.sorted_indices()
        self._entries = Entries(
            matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), matrix.data
        )
        self.held = held
        values = _held_values(self._entries, held)
        system = sp.csr_matrix((values, matrix.indices, matrix.indptr), shape=matrix.shape)
        self._factor = BlockFactor(system, tree)

    def hold(self, held: Hold) -> None:
        """Be held otherwise from now on."""
        self.held = held
        self._factor.refactor(_held_values(self._entries, held))

    @property
    def precision(self) -> np.dtype[Any]:
        """The type of the factor's numbers; what held the system before may have decided it."""
        return self._factor.precision

    def restore(self, held: Hold, precision: np.dtype[Any]) -> None:
        """Be held as at an earlier time, when the factor had this precision."""
        self.held = held
        self._factor.restore(_held_values(self._entries, held), precision)

    def add_solution(self, b: Floats, x: Floats) -> None:
        """Add to x (N, 3) the correction that b (N, 3) asks for."""
        self._factor.add_solution(b, x)

    def harmonic(self, group_at: Ints, first: int, out: Floats) -> None:
        """Put how far each vertex goes along with groups first, first + 1, first + 2 into out.

        A group's share (N,) is harmonic, one where it holds a vertex hard and zero where another
        does; `group_at` (N,) is the group at each vertex, or -1. All groups' shares sum to one.

        Source: Joshi et al. 2007, Harmonic coordinates for character articulation, section 3.
        """
        b = np.empty_like(out)
        _pulls_of_groups(self._entries, self.held, group_at, first, b)
        self._factor.solve(b, out)

    @property
    def nbytes(self) -> int:
        """The bytes that a solve reads of the factor."""
        return self._factor.nbytes


@kernel
def _held_values(laplacian: Entries, held: Hold) -> Floats:
    """The values of the held matrix."""
    starts, columns = laplacian.starts, laplacian.columns
    fixed, stiffness = held.fixed, held.stiffness
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
    laplacian: Entries, held: Hold, group_at: Ints, first: int, out: Floats
) -> None:
    """The right-hand sides of three groups' shares."""
    starts, columns, values = laplacian.starts, laplacian.columns, laplacian.values
    fixed, stiffness = held.fixed, held.stiffness
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
