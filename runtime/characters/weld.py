"""Welding: vertices that a file splits at its seams, made one again so that they move as one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

TOLERANCE = 1e-7
"""Of the diagonal of the bounding box: the rounding of float32 coordinates, and no feature."""

_NEIGHBOURS = 8  # looked at around a vertex, so that a heap of vertices in one spot stays cheap


def weld(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which welded vertex (M,) each file vertex is, counted in the order they first appear.

    Args:
        vertices: (M, 3) finite, any unit; equal ones, and those closer than `TOLERANCE` of the
            size, become one.
    """
    positions, distinct = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # -0 is 0
    reach = TOLERANCE * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    groups = _groups_within(positions, reach)[distinct.reshape(-1)]
    _, first, order = np.unique(groups, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    welded: NDArray[np.int64] = rank[order.reshape(-1)]
    return welded


def first_occurrences(groups: NDArray[np.int64]) -> NDArray[np.int64]:
    """The file vertex (N,) that each welded vertex of `weld` is first met as."""
    return np.asarray(np.unique(groups, return_index=True)[1], dtype=np.int64)


def welded_weights(weights: csr_array, groups: NDArray[np.int64]) -> csr_array:
    """The weights (N, K) of welded vertices: the mean of what (M, K) says of those made one."""
    count = np.bincount(groups)
    mean = csr_array(
        (1.0 / count[groups], (groups, np.arange(len(groups)))), shape=(len(count), len(groups))
    )
    return csr_array(mean @ weights)


def _groups_within(positions: NDArray[np.float64], reach: float) -> NDArray[np.int64]:
    """Labels (n,): equal for positions joined by steps no longer than `reach`."""
    count = len(positions)
    if reach <= 0.0 or count < 2:
        return np.arange(count)
    neighbours = min(_NEIGHBOURS, count)
    distance, near = cKDTree(positions).query(
        positions, k=neighbours, distance_upper_bound=reach, workers=2
    )
    row, column = np.nonzero(np.isfinite(distance))
    links = coo_array((np.ones(len(row)), (row, near[row, column])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
