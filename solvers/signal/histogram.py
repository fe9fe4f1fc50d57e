"""Percentiles of very many positive numbers, in memory that does not grow.

A histogram of bins of one width, from 0 up; its last bin holds all that lies beyond, and what is
not a number.
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
    """Where the bin (...) begins that so many percent of the numbers counted (..., B) reach.

    It is 0 where none were counted.
    """
    reached = np.cumsum(counts, axis=-1)
    below: Array = width * (reached < 0.01 * percent * reached[..., -1:]).sum(axis=-1)
    return below
