"""The dissection is a valid order of any graph, and the factor solves."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from solvers.linear.block_factor import BlockFactor
from solvers.linear.nested_dissection import dissect


def grid(n: int) -> tuple[sp.csr_matrix, np.ndarray]:
    """The Laplacian of an n by n grid, made definite at one corner, and its points."""
    index = np.arange(n * n).reshape(n, n)
    i = np.concatenate([index[1:].ravel(), index[:, 1:].ravel()])
    j = np.concatenate([index[:-1].ravel(), index[:, :-1].ravel()])
    A = sp.coo_matrix((-np.ones(len(i)), (i, j)), shape=(n * n, n * n)).tocsr()
    A = A + A.T
    degree = -np.asarray(A.sum(axis=1)).ravel()
    degree[0] += 1.0
    points = np.stack([index.ravel() // n, index.ravel() % n, 0 * index.ravel()], 1).astype(float)
    return sp.csr_matrix(A + sp.diags(degree)), points


def random_graph(count: int, edges: int, seed: int) -> tuple[sp.csr_matrix, np.ndarray]:
    """No geometry at all: edges between any two, several components, lone vertices."""
    rng = np.random.default_rng(seed)
    i, j = rng.integers(0, count, (2, edges))
    w = rng.uniform(0.1, 10.0, edges)
    A = sp.coo_matrix((-w[i != j], (i[i != j], j[i != j])), shape=(count, count)).tocsr()
    A = A + A.T
    degree = -np.asarray(A.sum(axis=1)).ravel() + rng.uniform(0.1, 1.0, count)
    return sp.csr_matrix(A + sp.diags(degree)), rng.normal(size=(count, 3))


CASES = [grid(1), grid(2), grid(30), random_graph(200, 300, 0), random_graph(600, 200, 1)]


@pytest.mark.parametrize(("matrix", "points"), CASES)
def test_blocks_touch_only_their_ancestors(matrix: sp.csr_matrix, points: np.ndarray):
    tree = dissect(matrix, points)
    count = matrix.shape[0]
    assert sorted(tree.order) == list(range(count))
    assert (np.diff(tree.firsts) > 0).all()
    assert tree.firsts[0] == 0
    assert tree.firsts[-1] == count
    blocks = np.repeat(np.arange(len(tree.parents)), np.diff(tree.firsts))
    assert all(parent < 0 or parent > b for b, parent in enumerate(tree.parents))
    permuted = matrix[tree.order][:, tree.order].tocoo()
    for low, high in {
        tuple(sorted((blocks[i], blocks[j]))) for i, j in zip(*permuted.coords, strict=True)
    }:
        b = low
        while b != high:
            b = tree.parents[b]
            assert b >= 0, f"blocks {low} and {high} touch across branches of the tree"


@pytest.mark.parametrize(("matrix", "points"), CASES)
def test_the_solution_is_added(matrix: sp.csr_matrix, points: np.ndarray):
    tree = dissect(matrix, points)
    permuted = sp.csr_matrix(matrix[tree.order][:, tree.order])
    factor = BlockFactor(permuted, tree)
    rng = np.random.default_rng(0)
    expected = rng.normal(size=(matrix.shape[0], 3))
    x = np.ones((matrix.shape[0] + 2, 3))
    factor.add_solution(permuted @ expected, x)
    np.testing.assert_allclose(x[:-2], expected + 1.0, atol=1e-3)
    np.testing.assert_array_equal(x[-2:], 1.0)
    for _ in range(3):  # refined with a residual in double precision, it is exact
        factor.add_solution(permuted @ (expected + 1.0 - x[:-2]), x)
    np.testing.assert_allclose(x[:-2], expected + 1.0, atol=1e-10)


def test_only_an_ill_conditioned_matrix_is_kept_in_double_precision():
    matrix, points = grid(24)
    tree = dissect(matrix, points)
    fair = sp.csr_matrix(matrix[tree.order][:, tree.order])
    loose = fair.copy()  # held by next to nothing: single precision cannot tell where it is
    corner = int(np.flatnonzero(tree.order == 0)[0])
    loose[corner, corner] -= 1.0 - 1e-13
    single, double = BlockFactor(fair, tree), BlockFactor(loose, tree)
    assert double.nbytes > 1.8 * single.nbytes
    expected = np.random.default_rng(0).normal(size=(24 * 24, 3))
    x = np.zeros_like(expected)
    double.solve(loose @ expected, x)
    error = x - expected
    assert np.vdot(error, loose @ error) < 1e-4 * np.vdot(expected, loose @ expected)


def test_an_empty_matrix_is_no_trouble():
    matrix = sp.csr_matrix((0, 0))
    tree = dissect(matrix, np.zeros((0, 3)))
    x = np.ones((2, 3))
    BlockFactor(matrix, tree).add_solution(np.zeros((0, 3)), x)
    np.testing.assert_array_equal(x, 1.0)
