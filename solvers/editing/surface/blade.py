"""What a surface is cut along: a plane, or a drawn line that is swept along the view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

MOST_POINTS = 200  # of a drawn line


@dataclass(frozen=True, slots=True, eq=False)
class Blade:
    """A ruled surface: a line in a plane, drawn on at both ends without end, swept across it.

    Attributes:
        axes: (3, 3) rows: two axes of the line's plane, and the direction of the sweep, each of
            length 1. The first two and the sweep's opposite are right-handed.
        line: (k, 2) corners of the line along the first two axes; its left is the positive side.
    """

    axes: Array
    line: Array

    def side(self, points: Array) -> Array:
        """Return the signed distance (n,) of points (n, 3), positive on the left of the line."""
        return _measured(points @ self.axes[:2].T, self.line)[0]

    def flat(self, points: Array) -> Array:
        """Return where points (n, 3) on the blade are on it (n, 2), as if it were unrolled."""
        along = _measured(points @ self.axes[:2].T, self.line)[1]
        return np.stack([along, points @ self.axes[2]], axis=1)

    def placed(self, flat: Array) -> Array:
        """Return the points (n, 3) at places (n, 2) on the unrolled blade."""
        steps = np.diff(self.line, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        starts = np.cumsum(lengths) - lengths
        at = np.clip(np.searchsorted(starts, flat[:, 0], side="right") - 1, 0, len(steps) - 1)
        share = (flat[:, 0] - starts[at]) / lengths[at]
        plane = self.line[at] + share[:, None] * steps[at]
        placed: Array = plane @ self.axes[:2] + flat[:, 1:] * self.axes[2]
        return placed

    def towards(self, point: ArrayLike) -> Blade:
        """Return the blade with its positive side where a point (3,) is."""
        here = self.side(np.asarray(point, dtype=np.float64)[None])[0]
        return self if here >= 0.0 else replace(self, line=self.line[::-1].copy())


def plane(point: ArrayLike, normal: ArrayLike) -> Blade:
    """Return the plane through a point (3,), with its positive side where the normal (3,) points.

    Raises:
        ValueError: the normal has no length.
    """
    up = _unit(normal, "a plane's normal")
    aside = _unit(np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))]), "")
    axes = np.stack([aside, up, np.cross(up, aside)])
    middle = axes[:2] @ np.asarray(point, dtype=np.float64)
    return Blade(axes, middle + np.array([[-1.0, 0.0], [1.0, 0.0]]))


def drawn(points: ArrayLike, view: ArrayLike) -> Blade:
    """Return a drawn line that cuts along the view.

    Args:
        points: (k, 3) of the line, in the world; two at least.
        view: (3,) the direction in which one looks, any length but 0.

    Raises:
        ValueError: the line has no length, crosses itself, or has values that are not finite.
    """
    corners = np.asarray(points, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1] != 3 or not np.isfinite(corners).all():
        raise ValueError(f"a drawn line has points (x, y, z), got the shape {corners.shape}")
    sweep = _unit(view, "the view")
    aside = _unit(np.cross(sweep, np.eye(3)[int(np.argmin(np.abs(sweep)))]), "")
    axes = np.stack([aside, np.cross(aside, sweep), sweep])
    line = _thinned(corners @ axes[:2].T)
    if len(line) < 2:
        raise ValueError("a drawn line needs a length, seen along the view")
    if _crosses_itself(line):
        raise ValueError("the drawn line crosses itself, drawn on at both ends; draw it straighter")
    return Blade(axes, line)


def _unit(vector: ArrayLike, what: str) -> Array:
    row = np.asarray(vector, dtype=np.float64)
    length = float(np.linalg.norm(row))
    if row.shape != (3,) or not 0.0 < length < np.inf:
        raise ValueError(f"{what} is a vector with a length, got {vector!r}")
    unit: Array = row / length
    return unit


def _thinned(line: Array) -> Array:
    """The line without points that are as good as where the one before is, and not too many."""
    extent = float(np.ptp(line, axis=0).max())
    kept = [line[0]]
    for point in line[1:]:
        if np.linalg.norm(point - kept[-1]) > 1e-3 * extent:
            kept.append(point)
    chosen = np.unique(np.linspace(0, len(kept) - 1, min(len(kept), MOST_POINTS)).astype(int))
    thinned: Array = np.array(kept)[chosen]
    return thinned


def _measured(points: Array, line: Array) -> tuple[Array, Array]:
    """The signed distance (n,) of points (n, 2) from a line, and how far along it they are (n,)."""
    steps = np.diff(line, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    units = steps / lengths[:, None]
    starts = np.cumsum(lengths) - lengths
    least, most = np.zeros(len(steps)), lengths.copy()
    least[0], most[-1] = -np.inf, np.inf
    nearest = np.full(len(points), np.inf)
    signed, along = np.zeros(len(points)), np.zeros(len(points))
    for at in range(len(steps)):
        apart = points - line[at]
        passed = np.clip(apart @ units[at], least[at], most[at])
        distance = np.linalg.norm(apart - passed[:, None] * units[at], axis=1)
        across = units[at, 0] * apart[:, 1] - units[at, 1] * apart[:, 0]
        # Beyond a corner, both of its sides are equally near; the one seen less askew knows the
        # sign.
        tie = np.abs(distance - nearest) <= 1e-9 * (distance + lengths[at])
        before = points - line[max(at - 1, 0)]
        askew = units[at - 1, 0] * before[:, 1] - units[at - 1, 1] * before[:, 0]
        better = np.where(tie, np.abs(across) > np.abs(askew), distance < nearest)
        signed = np.where(better, np.where(across < 0.0, -distance, distance), signed)
        along = np.where(better, starts[at] + passed, along)
        nearest = np.where(better, distance, nearest)
    return signed, along


def _crosses_itself(line: Array) -> bool:
    """Whether two sides meet that are no neighbours, the outer ones without end."""
    far = 1e3 * (float(np.ptp(line, axis=0).max()) + 1e-300)
    ends = line.copy()
    ends[0] += far * (line[0] - line[1]) / np.linalg.norm(line[0] - line[1])
    ends[-1] += far * (line[-1] - line[-2]) / np.linalg.norm(line[-1] - line[-2])
    first, last = ends[:-1], ends[1:]
    from_first = (
        _turn(first[:, None], last[:, None], first),
        _turn(first[:, None], last[:, None], last),
    )
    parted = from_first[0] * from_first[1] < 0.0
    number = np.arange(len(first))
    strangers = np.abs(number[:, None] - number) > 1
    return bool((parted & parted.T & strangers).any())


def _turn(a: Array, b: Array, c: Array) -> Array:
    out: Array = (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]
    return out
