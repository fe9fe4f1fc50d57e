"""Tells a sheet of paper from a body: arms drawn on a page are no limbs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

THIN = 0.15  # of the second extent: a surface that is thinner is flat
FULL = 0.85  # of its convex outline: a flat surface that fills so much of it has no limbs


def is_sheet(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> bool:
    """Whether a surface is flat and fills its convex outline.

    Args:
        vertices: (N, 3).
        faces: (F, 3).
    """
    extents = np.ptp(vertices, axis=0)
    across = int(np.argmin(extents))
    if extents[across] > THIN * np.sort(extents)[1]:
        return False
    a, b, c = (np.delete(vertices, across, axis=1)[faces[:, corner]] for corner in range(3))
    (x, y), (u, v) = (b - a).T, (c - a).T
    covered = 0.5 * np.abs(x * v - y * u).sum()
    edges = np.sort(np.concatenate([faces[:, :2], faces[:, 1:], faces[:, ::2]]), axis=1)
    _, times = np.unique(edges, axis=0, return_counts=True)
    sides = 1.0 if (times == 1).any() else 2.0  # a closed one covers its outline twice
    try:
        outline = float(ConvexHull(np.delete(vertices, across, axis=1)).volume)
    except (QhullError, ValueError):
        return False
    return bool(covered / sides > FULL * outline)
