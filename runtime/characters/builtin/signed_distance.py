"""Signed distances to model characters with: negative inside, in metres.

Source: J. C. Hart, "Sphere tracing", The Visual Computer 1996 (distance bounds and their blends);
I. Quilez, "Distance functions" (the ellipsoid's bound and the polynomial smooth minimum).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Field = Callable[[Array], Array]
"""Signed distances (n,) [m] of points (n, 3) [m]."""

FAR = 0.12
"""Beyond this distance [m] from its bounding box a tube answers with the distance to the box."""


def ellipsoid(center: ArrayLike, radii: ArrayLike, turn: Rotation | None = None) -> Field:
    """An ellipsoid with semi-axes `radii` (3,), turned about its centre; a sphere if one number."""
    middle = np.asarray(center, dtype=np.float64)
    axes = np.broadcast_to(np.asarray(radii, dtype=np.float64), 3)

    def field(points: Array) -> Array:
        local = points - middle if turn is None else turn.inv().apply(points - middle)
        scaled = np.linalg.norm(local / axes, axis=1)
        slope = np.linalg.norm(local / axes**2, axis=1)
        distance: Array = scaled * (scaled - 1.0) / np.maximum(slope, 1e-9)
        return np.where(scaled < 1e-6, -axes.min(), distance)

    return field


def tube(path: ArrayLike, radii: ArrayLike) -> Field:
    """A tube round the polyline `path` (k, 3) whose radius runs through `radii` (k,)."""
    nodes = np.asarray(path, dtype=np.float64)
    sizes = np.broadcast_to(np.asarray(radii, dtype=np.float64), len(nodes))
    lower, upper = nodes.min(axis=0) - sizes.max(), nodes.max(axis=0) + sizes.max()

    def field(points: Array) -> Array:
        outside = np.maximum(np.maximum(lower - points, points - upper), 0.0)
        distance: Array = np.linalg.norm(outside, axis=1)
        near = np.flatnonzero(distance < FAR)
        distance[near] = _to_segments(points[near], nodes, sizes)
        return distance

    return field


def _to_segments(points: Array, nodes: Array, sizes: Array) -> Array:
    nearest = np.full(len(points), np.inf)
    for start, end, first, last in zip(nodes, nodes[1:], sizes, sizes[1:], strict=False):
        bone = end - start
        along = np.clip((points - start) @ bone / (bone @ bone), 0.0, 1.0)
        gap = np.linalg.norm(points - start - along[:, None] * bone, axis=1)
        np.minimum(nearest, gap - (first + along * (last - first)), out=nearest)
    return nearest


def lathe(profile: ArrayLike, rounding: float) -> Field:
    """The solid that the polygon `profile` (k, 2) of (radius, height) sweeps about the Y axis."""
    outline = np.asarray(profile, dtype=np.float64)

    def field(points: Array) -> Array:
        flat = np.column_stack([np.hypot(points[:, 0], points[:, 2]), points[:, 1]])
        return _to_polygon(flat, outline) - rounding

    return field


def _to_polygon(points: Array, outline: Array) -> Array:
    nearest = np.full(len(points), np.inf)
    inside = np.zeros(len(points), dtype=bool)
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        edge = end - start
        along = np.clip((points - start) @ edge / (edge @ edge), 0.0, 1.0)
        np.minimum(
            nearest, np.linalg.norm(points - start - along[:, None] * edge, axis=1), out=nearest
        )
        if edge[1] != 0.0:
            rises = (start[1] <= points[:, 1]) != (end[1] <= points[:, 1])
            crossing = start[0] + (points[:, 1] - start[1]) * edge[0] / edge[1]
            inside ^= rises & (points[:, 0] < crossing)
    return np.where(inside, -nearest, nearest)


def union(*fields: Field) -> Field:
    """What lies in any of the fields, with creases where they meet."""
    return lambda points: reduce(np.minimum, (field(points) for field in fields))


def smooth_union(blend: float, *fields: Field) -> Field:
    """What lies in any of the fields, with fillets about `blend` [m] wide where they meet."""

    def join(first: Array, second: Array) -> Array:
        near = np.maximum(blend - np.abs(first - second), 0.0)
        joined: Array = np.minimum(first, second) - near**2 / (4.0 * blend)
        return joined

    return lambda points: reduce(join, (field(points) for field in fields))


def smooth_difference(blend: float, field: Field, cut: Field) -> Field:
    """What lies in `field` and not in `cut`, the rim rounded by about `blend` [m]."""

    def solid(points: Array) -> Array:
        first, second = field(points), -cut(points)
        near = np.maximum(blend - np.abs(first - second), 0.0)
        carved: Array = np.maximum(first, second) + near**2 / (4.0 * blend)
        return carved

    return solid


def intersection(*fields: Field) -> Field:
    """What lies in all of the fields."""
    return lambda points: reduce(np.maximum, (field(points) for field in fields))


def in_front(beyond: float) -> Callable[[Field], Field]:
    """What takes a field's section at z = 0 along Z, to where z is larger than `beyond`."""

    def decal(field: Field) -> Field:
        return lambda points: np.maximum(field(points * [1.0, 1.0, 0.0]), beyond - points[:, 2])

    return decal


def displaced(field: Field, height: Field) -> Field:
    """The field with its surface raised by `height` (n,) [m] of the points."""
    return lambda points: field(points) - height(points)


def grown(by: float, *fields: Field) -> Field:
    """The union of the fields, `by` [m] thicker: as a paint, it covers the parts themselves."""
    return lambda points: union(*fields)(points) - by


def curve(points: Sequence[ArrayLike], count: int) -> Array:
    """A smooth curve through `points`, as `count` points (count, 3) evenly spaced along it."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415  # slow to import

    knots = np.asarray(points, dtype=np.float64)
    spans = np.linalg.norm(np.diff(knots, axis=0), axis=1)
    places = np.concatenate([[0.0], np.cumsum(np.sqrt(spans))])
    spline = make_interp_spline(places, knots, k=min(3, len(knots) - 1))
    dense = spline(np.linspace(0.0, places[-1], 400))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    even = np.linspace(0.0, length[-1], count)
    return np.column_stack([np.interp(even, length, axis) for axis in dense.T])


def taper(values: Sequence[float], count: int) -> Array:
    """Radii (count,) that run smoothly, without overshoot, through evenly spaced `values`."""
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  # slow to import

    places = np.linspace(0.0, 1.0, len(values))
    radii: Array = PchipInterpolator(places, values)(np.linspace(0.0, 1.0, count))
    return radii
