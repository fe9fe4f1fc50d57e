"""The edges of a triangle mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    lengths = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    extent = np.ptp(vertices, axis=0).max(initial=0.0) if len(vertices) else 0.0
    kept: Indices = edges[lengths > SHORTEST * extent]
    return kept
