"""Percentiles from a histogram, against NumPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from solvers.signal.histogram import count, percentile

WIDTH, BINS = 0.01, 201


def counted(values: np.ndarray) -> np.ndarray:
    counts = np.zeros(BINS, np.int64)
    count(values, WIDTH, counts)
    return counts


@given(
    values=hnp.arrays(float, st.integers(1, 300), elements=st.floats(0.0, 1.99)),
    percent=st.floats(0.1, 100.0),
)
def test_a_percentile_is_numpys_to_within_a_bin(values: np.ndarray, percent: float) -> None:
    expected = np.percentile(values, percent, method="inverted_cdf")
    found = percentile(counted(values), WIDTH, percent)
    rounded = 1e-15  # WIDTH times a bin's number may lie above the number that was in the bin
    assert expected - 1.001 * WIDTH <= found <= expected * (1.0 + rounded)


def test_what_lies_beyond_or_is_no_number_counts_as_the_last() -> None:
    counts = counted(np.array([0.5, 2.0, 1e300, np.inf, np.nan]))
    assert counts[50] == 1
    assert counts[-1] == 4
    assert percentile(counts, WIDTH, 99.0) == 2.0


def test_each_row_has_its_percentile_and_that_of_nothing_is_0() -> None:
    counts = np.stack(
        [counted(np.full(3, 0.105)), counted(np.full(9, 1.505)), counted(np.zeros(0))]
    )
    np.testing.assert_allclose(percentile(counts, WIDTH, 95.0), [0.1, 1.5, 0.0])
    np.testing.assert_allclose(percentile(counts.sum(axis=0), WIDTH, 25.0), 0.1)
