"""Weld vertices that a file splits at seams, so that each point of the surface moves as one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

TOLERANCE = 1e-7
"""Share of the bounding box's diagonal: above float32 rounding, below any feature."""

APART = 1e-3
"""Share of the size by which morph targets must move two vertices apart to keep them two."""

_NEIGHBOURS = 8  # searched around each vertex; bounds the cost of many vertices in one spot


def weld(
    vertices: NDArray[np.float64], moves: NDArray[np.float64] | None = None
) -> NDArray[np.int64]:
    """The welded vertex (M,) of each file vertex, numbered by first appearance.

    Lips that touch at rest stay two: vertices that morph targets move apart are not welded.

    Args:
        vertices: (M, 3) finite, any unit; those closer than `TOLERANCE` times the size become
            one.
        moves: (M, 3) of each vertex, by any mixture of its morph targets, or None without any;
            those of vertices that become one differ by no more than `APART` times the size.
    """
    reach = TOLERANCE * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if moves is not None:
        vertices = np.hstack([vertices, moves * (TOLERANCE / APART)])
    positions, distinct = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # -0 is 0
    groups = _groups_within(positions, reach)[distinct.reshape(-1)]
    _, first, order = np.unique(groups, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    welded: NDArray[np.int64] = rank[order.reshape(-1)]
    return welded


def first_occurrences(groups: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first file vertex (N,) of each welded vertex."""
    return np.asarray(np.unique(groups, return_index=True)[1], dtype=np.int64)


def welded_weights(weights: csr_array, groups: NDArray[np.int64]) -> csr_array:
    """The weights (N, K) of welded vertices: the mean of those (M, K) of their file vertices."""
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
