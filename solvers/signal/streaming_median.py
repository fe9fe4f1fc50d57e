"""The median of very many positive numbers, from a logarithmic histogram of fixed size."""

from __future__ import annotations

import math

import numpy as np

_LOWEST, _DECADES, _BINS_A_DECADE = -12, 18, 50


class StreamingMedian:
    """Counts numbers in bins that are each 4.7 % wide, from 1e-12 to 1e6.

    A smaller number counts as 0, a larger one or NaN as 1e6.
    """

    def __init__(self) -> None:
        self._counts = np.zeros(_DECADES * _BINS_A_DECADE + 2, np.int64)

    def add(self, value: float) -> None:
        """Count one number."""
        last = len(self._counts) - 1
        place = last
        if value < 10.0 ** (_LOWEST + _DECADES):
            decades = math.log10(max(value, 1e-300)) - _LOWEST
            place = min(max(1 + math.floor(decades * _BINS_A_DECADE), 0), last)
        self._counts[place] += 1

    @property
    def median(self) -> float:
        """The median, to within half a bin; 0 before the first number."""
        counts = np.cumsum(self._counts)
        place = int(np.searchsorted(counts, 0.5 * counts[-1]))
        if place == 0:
            return 0.0
        return float(10.0 ** (_LOWEST + (place - 0.5) / _BINS_A_DECADE))
