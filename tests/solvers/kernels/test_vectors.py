"""Vectors in kernels do what single numbers would."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.kernels.compiled import kernel
from solvers.kernels.vectors import lane, load, load_row, repeat_three, store, zeros


@kernel
def combine(a, b, out):
    """2 a[1:5] - (a[0:4] + b[2] b[0:4])."""
    total = zeros(a, 4)
    total += load(a, 1, 4) * 2.0
    total -= load(a, 0, 4) + load(b, 0, 4) * b[2]
    store(total, out, 3)


@kernel
def last_row(points, out):
    row = load_row(points, len(points) - 1)
    store(row, out, 0)
    store(repeat_three(row), out, 4)
    out[12] = lane(row, 1)
    store(row * row, out, 13)


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_sums_and_products_go_lane_by_lane(precision: type):
    a, b = np.arange(1, 6).astype(precision), np.array([7, 5, 3, 2], precision)
    out = np.full(8, -1.0, precision)
    combine(a, b, out)
    expected = 2 * a[1:5] - (a[0:4] + b[2] * b)
    np.testing.assert_array_equal(out, [-1, -1, -1, *expected, -1])


def test_rows_of_three_become_four_and_eight():
    out = np.zeros(17)
    last_row(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), out)
    row = [4.0, 5.0, 6.0]
    np.testing.assert_array_equal(out, [*row, 0, *row, *row, 4, 5, 5, 16, 25, 36, 0])
