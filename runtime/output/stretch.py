"""How much a surface is stretched and squeezed, over a whole show."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from solvers.edges import edge_lengths, unique_edges

_BIN = 1e-4  # width of a bin: what p99 is exact to
_BINS = 100_000  # so stretches up to 10 are told apart; all above count as 10


class StretchStatistic:
    """Mean and 99th percentile of the relative change of edge length, |l / l0 - 1|.

    Takes every edge of every frame, in memory that does not grow: a histogram of bins 1e-4 wide,
    up to 10; what is longer, or not a number, counts as 10. Edges of no length at rest, which
    have no relative change, are left out.

    Args:
        vertices: (N, 3) rest positions.
        faces: (F, 3) triangles.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        rest = np.ascontiguousarray(vertices, np.float64)
        self._edges = unique_edges(rest, faces)
        self._inverse_lengths = 1.0 / edge_lengths(rest, self._edges)
        self._histogram = np.zeros(_BINS + 1, np.int64)
        self._sum = 0.0
        # Compiles now, or loads what an earlier run compiled, and not within the first frame.
        _accumulate(rest, self._edges, self._inverse_lengths, np.zeros_like(self._histogram))

    def add(self, vertices: NDArray[np.float64]) -> None:
        """Count all edges of one deformed surface (N, 3)."""
        positions = np.ascontiguousarray(vertices, np.float64)
        self._sum += _accumulate(positions, self._edges, self._inverse_lengths, self._histogram)

    @property
    def mean(self) -> float:
        """Mean stretch over all edges of all frames; 0 before the first."""
        return self._sum / max(int(self._histogram.sum()), 1)

    @property
    def p99(self) -> float:
        """The stretch that 99 % of all edges of all frames stay under; 0 before the first."""
        counts = np.cumsum(self._histogram)
        if counts[-1] == 0:
            return 0.0
        return float(_BIN * np.searchsorted(counts, 0.99 * counts[-1]))


@njit(cache=True)
def _accumulate(
    positions: NDArray[np.float64],
    edges: NDArray[np.int64],
    inverse_lengths: NDArray[np.float64],
    histogram: NDArray[np.int64],
) -> float:
    """Put every edge's stretch into `histogram`, whose last bin is all above; give their sum."""
    last = len(histogram) - 1
    bins = 0.0
    for edge in range(len(edges)):
        a, b = edges[edge, 0], edges[edge, 1]
        x = positions[a, 0] - positions[b, 0]
        y = positions[a, 1] - positions[b, 1]
        z = positions[a, 2] - positions[b, 2]
        stretch = abs(np.sqrt(x * x + y * y + z * z) * inverse_lengths[edge] - 1.0) / _BIN
        if not stretch < last:  # also when it is not a number
            stretch = float(last)
        bins += stretch
        histogram[int(stretch)] += 1
    return bins * _BIN
