"""The grid of 3 by 3 that docs/solver-internals.md eliminates by hand."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from solvers.linear.block_factor import BlockFactor
from solvers.linear.blocks import Entries
from solvers.linear.nested_dissection import Dissection
from solvers.linear.panels import NARROW
from solvers.linear.symbolic import plan_blocks

ORDER = np.array([0, 3, 6, 2, 5, 8, 1, 4, 7], np.int32)
TREE = Dissection(ORDER, np.array([0, 3, 6, 9], np.int32), np.array([2, 2, -1], np.int32))

LEFT = np.array([[5, 2, 1], [2, 6, 3], [1, 3, 8]]) / 13  # inverses of the pivot blocks
RIGHT = np.array([[5, 2, 1], [2, 4, 2], [1, 2, 5]]) / 8
FRONT = np.array([[3, -1, 0], [-1, 4, -1], [0, -1, 3]]) - LEFT - RIGHT


@pytest.fixture
def matrix() -> sp.csr_matrix:
    """The Laplacian of the grid and a spring at vertex 0, in the order of elimination."""
    index = np.arange(9).reshape(3, 3)
    i = np.concatenate([index[1:].ravel(), index[:, 1:].ravel()])
    j = np.concatenate([index[:-1].ravel(), index[:, :-1].ravel()])
    edges = sp.coo_matrix((np.ones(12), (i, j)), shape=(9, 9)).toarray()
    laplacian = np.diag((edges + edges.T).sum(axis=0)) - edges - edges.T
    laplacian[0, 0] += 1.0
    return sp.csr_matrix(laplacian[np.ix_(ORDER, ORDER)])


def test_blocks_touch_the_separator(matrix: sp.csr_matrix):
    entries = Entries(matrix.indptr, matrix.indices, matrix.data)
    _, _, updates = plan_blocks(entries, TREE)
    np.testing.assert_array_equal(updates.reach, [0, 1, 2, 6, 7, 8, 3, 4, 5, 6, 7, 8, 6, 7, 8])


def test_panels_hold_the_inverses_that_the_page_states(matrix: sp.csr_matrix):
    factor = BlockFactor(matrix, TREE)
    ups = factor._panels.ups.reshape(2, 3, NARROW)[:, :, :3]
    np.testing.assert_allclose(ups, [LEFT.T, RIGHT.T], rtol=1e-6)  # -G^T, where B = -1
    downs = factor._panels.downs.reshape(15, NARROW)[:, :3]  # the last block first
    expected = np.concatenate([np.linalg.inv(FRONT), RIGHT, RIGHT, LEFT, LEFT])
    np.testing.assert_allclose(downs, expected, rtol=1e-6)


def test_updates_are_what_the_separator_loses(matrix: sp.csr_matrix):
    factor = BlockFactor(matrix, TREE)
    kept = factor._updates.kept.reshape(2, 3, 3)
    np.testing.assert_allclose(kept, [-LEFT, -RIGHT], rtol=1e-12)
