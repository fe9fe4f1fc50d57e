"""Where a blade crosses a surface, and which of these places are round the bone that is cut."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from solvers.editing.surface.blade import Blade
from solvers.editing.surface.sheet import Array, Flags, Indices
from solvers.editing.surface.splitting import levelled

REACH = 1.1
"""What a blade crosses farther off than this, in reaches of what goes round the bone, stays."""


def crossed_round(vertices: Array, triangles: Indices, blade: Blade, at: Array) -> Flags:
    """Return the triangles (F,) that a blade is to cut: those round a point, and what they hold.

    A plane through a forearm goes through the other one too, which is to stay whole. So a strip of
    crossed triangles is cut where it goes round the point more than half; so are strips that are
    nowhere farther from the point, such as a sleeve's lining or a button. Where none goes round,
    the nearest one is cut.

    Args:
        vertices: (N, 3).
        triangles: (F, 3).
        blade: what cuts.
        at: (3,) the point, on the blade.

    Raises:
        ValueError: the blade crosses nothing.
    """
    side = levelled(blade.side(vertices))
    corner = side[triangles]
    touched = np.flatnonzero((corner.min(axis=1) <= 0.0) & (corner.max(axis=1) >= 0.0))
    first, last, owner = _segments(vertices, triangles[touched], corner[touched], blade)
    if not len(owner):
        raise ValueError("the cut goes past the surface; nothing is there to be cut")
    strips = _strips(triangles[touched])
    strip = strips[owner]
    centre = blade.flat(at[None])[0]
    first, last = first - centre, last - centre
    turned = np.arctan2(
        first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0], (first * last).sum(axis=1)
    )
    count = int(strip.max()) + 1
    around = np.abs(np.bincount(strip, turned, count)) > np.pi
    away = np.maximum(np.linalg.norm(first, axis=1), np.linalg.norm(last, axis=1))
    farthest, nearest = np.zeros(count), np.full(count, np.inf)
    np.maximum.at(farthest, strip, away)
    np.minimum.at(nearest, strip, away)
    if not around.any():
        around[int(np.argmin(nearest))] = True
    chosen = around | (farthest <= REACH * farthest[around].max())
    cut = np.zeros(len(triangles), dtype=np.bool_)
    known = np.zeros(int(strips.max()) + 1, dtype=np.bool_)
    known[:count] = chosen & np.isfinite(nearest)
    cut[touched] = known[strips]
    return cut


def _strips(triangles: Indices) -> Indices:
    """The number (F,) of the set of triangles, joined by vertices, that each is in."""
    known, place = np.unique(triangles, return_inverse=True)
    place = place.reshape(-1, 3)
    rows = np.concatenate([place[:, 0], place[:, 1]])
    columns = np.concatenate([place[:, 1], place[:, 2]])
    shape = (len(known), len(known))
    links = coo_array((np.ones(len(rows)), (rows, columns)), shape=shape)
    label: Indices = connected_components(links, directed=False)[1][place[:, 0]].astype(np.int64)
    return label


def _segments(
    vertices: Array, triangles: Indices, side: Array, blade: Blade
) -> tuple[Array, Array, Indices]:
    """Where the blade crosses each triangle: from (S, 2), to (S, 2), unrolled; the triangle (S,).

    With the positive side of the blade above, a hole that is seen from there is gone round
    clockwise, what is solid the other way.
    """
    leaves, enters = np.zeros((len(triangles), 3)), np.zeros((len(triangles), 3))
    has = np.zeros((len(triangles), 2), dtype=np.bool_)
    for k in range(3):
        a, b = triangles[:, k], triangles[:, (k + 1) % 3]
        here, there = side[:, k], side[:, (k + 1) % 3]
        share = here / np.where(here == there, 1.0, here - there)
        crossing = vertices[a] + share[:, None] * (vertices[b] - vertices[a])
        down, up = (here >= 0.0) & (there < 0.0), (here < 0.0) & (there >= 0.0)
        leaves[down], enters[up] = crossing[down], crossing[up]
        has[:, 0] |= down
        has[:, 1] |= up
    owner = np.flatnonzero(has.all(axis=1))
    return blade.flat(leaves[owner]), blade.flat(enters[owner]), owner
