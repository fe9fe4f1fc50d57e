"""Closes openings: the flat polygon in a rim is filled with even triangles."""

from __future__ import annotations

from collections.abc import Sequence

import mapbox_earcut
import numpy as np
from scipy.spatial import Delaunay, KDTree, QhullError

from solvers.editing.surface.sheet import Array, Flags, Indices

MOST_INSIDE = 2_000  # new vertices of one cap, about; a larger one gets longer edges
_CLEAR = 0.6  # of an edge's length, between the rim and what is new
_ROUNDS = 4  # of moving what is new to the mean of its neighbours


def nested(rims: Sequence[Array]) -> list[list[int]]:
    """Sort closed rims: each group is one that goes round counter-clockwise, then its holes.

    A rim that goes round the other way and is in none is a group of its own.

    Args:
        rims: (n, 2) each, in one plane.
    """
    areas = [_area(rim) for rim in rims]
    outer = [at for at, area in enumerate(areas) if area > 0.0]
    groups = {at: [at] for at in outer}
    for at, rim in enumerate(rims):
        if areas[at] > 0.0:
            continue
        round_it = [other for other in outer if _inside(rim[:1], [rims[other]])[0]]
        if round_it:
            groups[min(round_it, key=lambda other: areas[other])].append(at)
        else:
            groups[at] = [at]
    return list(groups.values())


def filled(rims: Sequence[Array], edge: float) -> tuple[Array, Indices]:
    """Fill a rim, less its holes, with triangles whose edges are about as long as asked.

    Args:
        rims: (n, 2) each: the outer one, counter-clockwise, then holes, clockwise.
        edge: the length that is asked.

    Returns:
        New places (p, 2), and triangles (t, 3), counter-clockwise, into the rims' places one after
        the other and then the new ones. The rims' own edges are the border. There is nothing new
        where the rims are so winding that only the rims' places do.

    Raises:
        ValueError: a rim crosses itself or another.
    """
    border = np.concatenate(list(rims))
    new = _spread(rims, border, edge)
    for _ in range(_ROUNDS if len(new) else 0):
        triangles = _triangles(rims, np.concatenate([border, new]))
        if triangles is None:
            break
        new = _relaxed(border, new, triangles)
    for inside in (new, np.zeros((0, 2))):
        triangles = _triangles(rims, np.concatenate([border, inside]))
        if triangles is not None:
            return inside, triangles
    return np.zeros((0, 2)), _ears(rims)


def _spread(rims: Sequence[Array], border: Array, edge: float) -> Array:
    """Places (p, 2) of a triangular grid inside, not too near to the rims."""
    low, high = border.min(axis=0), border.max(axis=0)
    edge = max(edge, float(np.sqrt(np.prod(high - low) / MOST_INSIDE)))
    if not edge > 0.0:
        return np.zeros((0, 2))
    middle, size = 0.5 * (low + high), np.ceil(0.5 * (high - low) / edge) + 1.0
    rows = np.arange(-size[1], size[1] + 1.0)
    columns = np.arange(-size[0], size[0] + 1.0)
    x = columns[None, :] + 0.5 * (np.abs(rows[:, None]) % 2)
    y = np.broadcast_to(rows[:, None] * np.sqrt(0.75), x.shape)
    grid = middle + edge * np.stack([x.ravel(), y.ravel()], axis=1)
    middles = np.concatenate([0.5 * (rim + np.roll(rim, -1, axis=0)) for rim in rims])
    clear = KDTree(np.concatenate([border, middles])).query(grid)[0] > _CLEAR * edge
    grid = grid[clear]
    spread: Array = grid[_inside(grid, rims)]
    return spread


def _inside(points: Array, rims: Sequence[Array]) -> Flags:
    """Whether points (n, 2) are in an odd number of rims (n,)."""
    odd = np.zeros(len(points), dtype=np.bool_)
    for rim in rims:
        for a, b in zip(rim, np.roll(rim, -1, axis=0), strict=True):
            rows = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
            if rows.any():
                x = a[0] + (points[rows, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
                odd[rows] ^= points[rows, 0] < x
    return odd


def _triangles(rims: Sequence[Array], points: Array) -> Indices | None:
    """The Delaunay triangles inside the rims (t, 3), or None where a rim is not of their edges."""
    try:
        found = Delaunay(points).simplices.astype(np.int64)
    except QhullError:
        return None
    a, b, c = points[found].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    found[area < 0.0] = found[area < 0.0][:, ::-1]
    scale = float(np.prod(np.ptp(points, axis=0)))
    found = found[np.abs(area) > 1e-12 * scale]
    found = found[_inside(points[found].mean(axis=1), rims)]
    whole = len(np.unique(found)) == len(points) and _bordered(found, _sides(rims))
    return found if whole else None


def _sides(rims: Sequence[Array]) -> Indices:
    """The rims' edges (n, 2), into their places one after the other."""
    starts = np.cumsum([0, *(len(rim) for rim in rims)])
    rings = [start + np.arange(len(rim)) for start, rim in zip(starts, rims, strict=False)]
    return np.concatenate([np.stack([ring, np.roll(ring, -1)], axis=1) for ring in rings])


def _bordered(triangles: Indices, sides: Indices) -> bool:
    """Whether these edges are the border of triangles, and each other edge is between two."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    name = np.array([int(max(edges.max(initial=0), sides.max(initial=0))) + 1, 1])
    back, border = edges[:, ::-1] @ name, sides[:, ::-1] @ name
    one = np.sort(np.concatenate([edges @ name, border]))
    other = np.sort(np.concatenate([back, sides @ name]))
    return bool((np.diff(one) > 0).all()) and bool((one == other).all())


def _relaxed(border: Array, new: Array, triangles: Indices) -> Array:
    """The new places, each at the mean of its neighbours."""
    points = np.concatenate([border, new])
    heads, tails = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    total, count = np.zeros_like(points), np.zeros(len(points))
    np.add.at(total, heads, points[tails])
    np.add.at(count, heads, 1.0)
    moved: Array = total[len(border) :] / count[len(border) :, None]
    return moved


def _ears(rims: Sequence[Array]) -> Indices:
    """Triangles (t, 3) between the rims' own places."""
    ends = np.cumsum([len(rim) for rim in rims]).astype(np.uint32)
    points = np.concatenate(list(rims))
    found = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3).astype(np.int64)
    a, b, c = points[found].transpose(1, 0, 2) if len(found) else np.zeros((3, 0, 2))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    found[area < 0.0] = found[area < 0.0][:, ::-1]
    if not len(found) or not _bordered(found, _sides(rims)):
        raise ValueError("the surface crosses itself where it is cut; cut elsewhere")
    return found


def _area(rim: Array) -> float:
    after = np.roll(rim, -1, axis=0)
    return float(0.5 * (rim[:, 0] * after[:, 1] - rim[:, 1] * after[:, 0]).sum())
