"""The edges of a triangle mesh."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.compiled import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SHORTEST = 1e-9  # of the mesh's extent; what is shorter has no length to compare with


def unique_edges(vertices: Array, faces: Indices) -> Indices:
    """Every edge (E, 2) that has a length, once, the lower index first, in order.

    Args:
        vertices: (N, 3).
        faces: (F, 3).
    """
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
    count = max(len(vertices), 1)
    keys = np.unique(sides[:, 0] * count + sides[:, 1])  # a number an edge sorts faster than a row
    edges = np.stack([keys // count, keys % count], axis=1)
    extent = np.ptp(vertices, axis=0).max(initial=0.0) if len(vertices) else 0.0
    kept: Indices = edges[edge_lengths(vertices, edges) > SHORTEST * extent]
    return kept


def edge_lengths(points: Array, edges: Indices) -> Array:
    """Length (E,) of each edge (E, 2) between points (N, 3), in their unit."""
    out = np.empty(len(edges))
    _lengths(np.ascontiguousarray(points, np.float64), np.ascontiguousarray(edges), out)
    return out


def stretch(points: Array, edges: Indices, rest_lengths: Array) -> Array:
    """Relative change |l / l0 - 1| of each edge (E, 2) between points (N, 3).

    Args:
        points: (N, 3), in any unit.
        edges: (E, 2).
        rest_lengths: (E,) their lengths at rest, in the same unit, none zero.
    """
    out = edge_lengths(points, edges)
    out /= rest_lengths
    out -= 1.0
    return np.abs(out, out=out)


@kernel
def _lengths(points: Array, edges: Indices, out: Array) -> None:
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        x = points[i, 0] - points[j, 0]
        y = points[i, 1] - points[j, 1]
        z = points[i, 2] - points[j, 2]
        out[e] = math.sqrt(x * x + y * y + z * z)
