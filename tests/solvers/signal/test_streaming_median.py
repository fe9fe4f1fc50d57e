"""The running median: near the true one, and defined for nothing and for extremes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.signal.streaming_median import StreamingMedian


@given(values=st.lists(st.floats(1e-9, 1e3), min_size=1, max_size=40))
def test_the_median_is_near(values: list[float]) -> None:
    histogram = StreamingMedian()
    for value in values:
        histogram.add(value)
    lower = np.percentile(values, 50, method="inverted_cdf")
    assert histogram.median == pytest.approx(lower, rel=0.05)


def test_the_median_of_nothing_and_of_what_no_bin_holds() -> None:
    assert StreamingMedian().median == 0.0
    histogram = StreamingMedian()
    histogram.add(0.0)
    assert histogram.median == 0.0
    for value in (np.inf, np.nan, 1e300):
        histogram.add(value)
    assert histogram.median == pytest.approx(1e6, rel=0.05)
