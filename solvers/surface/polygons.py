"""Cut polygons into triangles: convex ones as fans, concave ones by clipping ears.

A fan turns some triangles of a concave polygon inside out. Ear clipping does not. The ear clipper
is mapbox's earcut (Held, "FIST: fast industrial-strength triangulation of polygons", 2001). Convex
polygons keep the fan from their first corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]

_REFLEX = 1e-6  # sine of a turn inwards at a corner; a polygon with such a corner is concave
_AREA = 1e-6  # relative difference of area between a polygon and its triangles
_MOST_WORK = 10**9  # sum of squared corner counts; earcut takes at most about 6 s for it
_OTHER_DIAGONAL = np.array([[1, 2, 3], [1, 3, 0]])


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """The triangles of a list of polygons, polygon after polygon.

    Attributes:
        corners: (T, 3) into the list of all corners; a polygon of n corners has n - 2 triangles.
        polygon: (T,) the polygon that each triangle belongs to.
        doubtful: number of concave polygons that are cut as fans, because their edges cross or
            because clipping their ears would take too long.
    """

    corners: Indices
    polygon: Indices
    doubtful: int = 0


def triangulate(positions: Array, sizes: Indices) -> Triangulation:
    """Cut polygons into triangles that turn the same way as their polygon.

    Args:
        positions: (C, 3) of the corners, polygon after polygon, in any unit.
        sizes: (P,) number of corners of each polygon; fewer than three give no triangle.
    """
    starts = np.cumsum(sizes) - sizes
    fan = _fans(starts, sizes)
    large = np.flatnonzero(sizes > 3)
    if not len(large):
        return fan
    polygon, reflex = _reflex_corners(positions, starts[large], sizes[large])
    count = np.bincount(polygon[reflex], minlength=len(large))
    first = np.cumsum(np.maximum(sizes - 2, 0)) - np.maximum(sizes - 2, 0)
    quads = count * (sizes[large] == 4)
    doubtful = int(np.count_nonzero(quads > 1))
    place = np.flatnonzero(reflex) - (np.cumsum(sizes[large]) - sizes[large])[polygon[reflex]]
    odd = (quads == 1)[polygon[reflex]] & (place % 2 == 1)
    for triangle in range(2):
        chosen = large[polygon[reflex][odd]]
        fan.corners[first[chosen] + triangle] = starts[chosen, None] + _OTHER_DIAGONAL[triangle]
    work = 0
    for each in large[(count > 0) & (sizes[large] > 4)].tolist():
        start, size = int(starts[each]), int(sizes[each])
        work += size * size
        ears = None if work > _MOST_WORK else _ears(_flat(positions[start : start + size]))
        if ears is None:
            doubtful += 1
        else:
            fan.corners[first[each] : first[each] + size - 2] = start + ears
    return Triangulation(fan.corners, fan.polygon, doubtful)


def _fans(starts: Indices, sizes: Indices) -> Triangulation:
    """Every polygon as a fan from its first corner."""
    counts = np.maximum(sizes - 2, 0)
    polygon = np.repeat(np.arange(len(sizes)), counts)
    step = np.arange(len(polygon)) - (np.cumsum(counts) - counts)[polygon] + 1
    corners = starts[polygon][:, None] + np.column_stack([np.zeros_like(step), step, step + 1])
    return Triangulation(corners, polygon)


def _reflex_corners(positions: Array, starts: Indices, sizes: Indices) -> tuple[Indices, Flags]:
    """The polygon (c,) of each corner, and whether the polygon turns inwards there (c,).

    The outward direction is the polygon's normal after Newell (Sutherland et al., "A
    characterization of ten hidden-surface algorithms", 1974).
    """
    polygon = np.repeat(np.arange(len(starts)), sizes)
    offset = np.cumsum(sizes) - sizes
    place = np.arange(len(polygon)) - offset[polygon]
    here = positions[starts[polygon] + place]
    after = positions[starts[polygon] + (place + 1) % sizes[polygon]]
    origin = positions[starts][polygon]
    normals = np.add.reduceat(np.cross(here - origin, after - origin), offset, axis=0)
    edges = after - here
    before = edges[offset[polygon] + (place - 1) % sizes[polygon]]
    turn = np.einsum("ij,ij->i", np.cross(before, edges), normals[polygon])
    length = np.linalg.norm(edges, axis=1)
    scale = length * np.linalg.norm(before, axis=1) * np.linalg.norm(normals, axis=1)[polygon]
    return polygon, turn < -_REFLEX * scale


def _flat(corners: Array) -> Array:
    """Corners (n, 3) without the coordinate along which their normal is longest: (n, 2).

    The plane is seen from the side that the normal points to. Leaving a coordinate out, rather than
    turning the plane, keeps corners on one line exactly on one line.
    """
    local = corners - corners[0]
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    flat = local[:, [(axis + 1) % 3, (axis + 2) % 3]]
    return np.ascontiguousarray(flat if normal[axis] > 0.0 else flat[:, ::-1])


def _ears(flat: Array) -> Indices | None:
    """The triangles (n - 2, 3) of a polygon (n, 2), or None where its edges cross."""
    ring = np.array([len(flat)], dtype=np.uint32)
    triangles = mapbox_earcut.triangulate_float64(flat, ring).reshape(-1, 3).astype(np.int64)
    if not len(triangles):
        return None
    following = np.roll(flat, -1, axis=0)
    area = 0.5 * float(np.sum(flat[:, 0] * following[:, 1] - flat[:, 1] * following[:, 0]))
    a, b, c = flat[triangles].transpose(1, 2, 0)
    parts = 0.5 * ((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
    if not (abs(parts.sum() - area) <= _AREA * area and parts.min() >= -_AREA * area):
        return None
    return _with_dropped(triangles, len(flat))


def _with_dropped(triangles: Indices, size: int) -> Indices | None:
    """The triangles with the corners that earcut drops: those on the line between two others.

    The neighbouring polygon has such a corner too, so without it the surface would have a crack.
    The triangle on that line becomes a fan from its third corner.
    """
    if len(triangles) == size - 2:
        return triangles
    kept = np.unique(triangles)
    after = dict(zip(kept.tolist(), np.roll(kept, -1).tolist(), strict=True))
    whole: list[tuple[int, int, int]] = []
    pending = [tuple(triangle) for triangle in triangles.tolist()]
    while pending:
        a, b, c = pending.pop()
        for start, end, apex in ((a, b, c), (b, c, a), (c, a, b)):
            between = (end - start) % size - 1
            if after.get(start) == end and between > 0:
                ring = [(start + i) % size for i in range(between + 2)]
                # One side at a time: the parts may have another such side.
                pending += [(x, y, apex) for x, y in pairwise(ring)]
                break
        else:
            whole.append((a, b, c))
    return np.array(whole) if len(whole) == size - 2 else None
