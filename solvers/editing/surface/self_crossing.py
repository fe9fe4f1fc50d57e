"""Whether a surface crosses itself near some of its triangles."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from solvers.editing.surface.sheet import Array, Flags, Indices

_ROUNDING = 1e-9  # of the surface's size: what lies in one plane does not cross


def crosses_itself(vertices: Array, triangles: Indices, chosen: Flags) -> bool:
    """Return whether an edge of a chosen triangle goes through a triangle, or the other way round.

    Args:
        vertices: (N, 3).
        triangles: (F, 3).
        chosen: (F,) the triangles that may cross others.
    """
    corners = vertices[triangles]
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    mine = np.flatnonzero(chosen)
    limit = float(reach[mine].max(initial=0.0))
    near = np.flatnonzero(
        KDTree(middles[mine]).query(middles, distance_upper_bound=limit + reach.max())[0] < np.inf
    )
    pairs = KDTree(middles[mine]).query_ball_point(middles[near], reach[near] + limit)
    counts = np.array([len(each) for each in pairs], dtype=np.int64)
    one = mine[np.concatenate([np.array(each, dtype=np.int64) for each in pairs])]
    other = np.repeat(near, counts)
    apart = np.linalg.norm(middles[one] - middles[other], axis=1) <= reach[one] + reach[other]
    # Triangles that share one corner may still cross; those that share an edge cannot.
    common = (triangles[one][:, :, None] == triangles[other][:, None, :]).sum(axis=(1, 2))
    apart &= common < 2
    one, other = one[apart], other[apart]
    fine = _ROUNDING * float(np.ptp(vertices, axis=0).max())
    return _pierced(corners[one], corners[other], fine) or _pierced(
        corners[other], corners[one], fine
    )


def _pierced(edges_of: Array, through: Array, fine: float) -> bool:
    """Whether an edge of the first triangle (P, 3, 3) of a pair goes through the second."""
    p, q, r = through.transpose(1, 0, 2)
    normal = np.cross(q - p, r - p)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    height = ((edges_of - p[:, None]) * normal[:, None]).sum(axis=2) / length[:, None]
    for k in range(3):
        a, b = edges_of[:, k], edges_of[:, (k + 1) % 3]
        low, high = height[:, k], height[:, (k + 1) % 3]
        rows = np.flatnonzero((low * high < 0.0) & (np.minimum(np.abs(low), np.abs(high)) > fine))
        if not len(rows):
            continue
        share = (low[rows] / (low[rows] - high[rows]))[:, None]
        x = a[rows] + share * (b[rows] - a[rows])
        inside = np.ones(len(rows), dtype=np.bool_)
        for start, end in ((p, q), (q, r), (r, p)):
            side = np.cross(end[rows] - start[rows], x - start[rows])
            inside &= (side * normal[rows]).sum(axis=1) > 0.0
        if inside.any():
            return True
    return False
