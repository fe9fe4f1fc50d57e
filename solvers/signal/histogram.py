"""Percentiles of very many positive numbers, from a histogram of fixed size.

All bins have one width, from 0 up. The last bin also counts larger numbers and NaN.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


@kernel
def count(values: Array, width: float, counts: Counts) -> None:
    """Add numbers (n,) to the counts (B,) of bins of this width, in place."""
    last = len(counts) - 1
    for value in values:
        place = value / width
        counts[int(place) if place < last else last] += 1


def percentile(counts: Counts, width: float, percent: float) -> Array:
    """Return the start (...) of the bin that contains a percentile of the counts (..., B).

    It is 0 where the counts are empty.
    """
    reached = np.cumsum(counts, axis=-1)
    below: Array = width * (reached < 0.01 * percent * reached[..., -1:]).sum(axis=-1)
    return below
