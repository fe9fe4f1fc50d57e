"""Short loops in kernels do what NumPy does."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from solvers.kernels.short_loops import median, put

NUMBERS = st.lists(st.floats(allow_nan=False, width=32), min_size=1, max_size=40)


@given(NUMBERS)
def test_a_median_is_that_of_numpy_and_its_operand_stays(numbers: list[float]) -> None:
    values = np.array(numbers, dtype=np.float64)
    with np.errstate(invalid="ignore"):  # the mean of infinities that oppose is NaN in both
        wanted = np.median(values)
    np.testing.assert_array_equal(median(values), wanted)
    np.testing.assert_array_equal(values, numbers)


def test_numbers_are_put_into_a_row_of_a_table() -> None:
    table = np.zeros((3, 4))
    put(table[1], np.arange(4.0))
    put(table[:, 0], np.array([7.0, 8.0, 9.0]))
    np.testing.assert_array_equal(table, [[7, 0, 0, 0], [8, 1, 2, 3], [9, 0, 0, 0]])
