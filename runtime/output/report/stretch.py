"""Statistics of the edge stretch of a surface, over a whole show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.signal.histogram import count, percentile

_BIN = 1e-4  # width of a bin, and so the precision of p99
_MOST = 10.0  # larger stretch, and NaN, count as this


class StretchStatistic:
    """Mean and 99th percentile of the relative change of edge length, |l / l0 - 1|.

    Counts every edge of every frame, in memory that does not grow.
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
        """99th percentile of the stretch over all edges of all frames; 0 before the first."""
        return float(percentile(self._counts, _BIN, 99.0))
