"""How much a surface is stretched and squeezed, over a whole show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.signal.histogram import count, percentile

_BIN = 1e-4  # width of a bin: what p99 is exact to
_MOST = 10.0  # what is longer, or not a number, counts as this


class StretchStatistic:
    """Mean and 99th percentile of the relative change of edge length, |l / l0 - 1|.

    Takes every edge of every frame, in memory that does not grow.
    """

    def __init__(self) -> None:
        self._counts = np.zeros(round(_MOST / _BIN) + 1, np.int64)
        self._sum = 0.0

    def add(self, stretch: NDArray[np.float64]) -> None:
        """Count all edges (E,) of one deformed surface."""
        count(stretch, _BIN, self._counts)
        self._sum += float(np.fmin(stretch, _MOST).sum())

    @property
    def mean(self) -> float:
        """Mean stretch over all edges of all frames; 0 before the first."""
        return self._sum / max(int(self._counts.sum()), 1)

    @property
    def p99(self) -> float:
        """The stretch that 99 % of all edges of all frames stay under; 0 before the first."""
        return float(percentile(self._counts, _BIN, 99.0))
