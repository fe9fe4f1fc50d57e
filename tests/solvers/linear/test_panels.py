"""Panels hold any matrix, and their product is the matrix's."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.linear.panels import NARROW, WIDE, lay_panels, multiply, panels_size


@pytest.mark.parametrize("columns", [0, 1, 8, 9, 16, 17, 24, 25, 40])
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_the_product_is_that_of_the_matrix(columns: int, precision: type):
    rng = np.random.default_rng(columns)
    rows, at = 11, 5
    matrix = rng.normal(size=(rows, columns))
    size = int(panels_size(np.array(rows), np.array(columns)))
    assert size < rows * (columns + NARROW)
    panels = np.zeros(at + size, precision)
    lay_panels(matrix, panels[at:])
    vectors = rng.normal(size=(50, 3)).astype(precision)
    picked = rng.integers(0, 50, 20).astype(np.int32)
    begin, end = 4, 4 + rows
    sums = np.full((3, 40 + WIDE), np.nan, precision)
    multiply(panels, at, columns, vectors, picked, begin, end, sums)
    expected = vectors[picked[begin:end]].astype(np.float64).T @ matrix
    tolerance = 50 * np.finfo(precision).eps
    np.testing.assert_allclose(sums[:, :columns], expected, rtol=0, atol=tolerance)
    assert np.isnan(sums[:, -(-columns // NARROW) * NARROW :]).all(), "beyond the last panel"


def test_no_rows_give_zero():
    sums = np.full((3, WIDE), np.nan)
    nothing = np.zeros(0, np.int32)
    multiply(np.zeros(0), 0, WIDE, np.zeros((1, 3)), nothing, 0, 0, sums)
    np.testing.assert_array_equal(sums, 0.0)
