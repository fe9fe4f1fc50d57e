"""Finds vertical planes in which a surface is its own mirror image, or nearly so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

SYMMETRIC = 0.02
"""The greatest asymmetry of a body that only its pose makes unequal."""

_PROBES = 1000  # points whose mirror images are compared
_YAWS = 36  # directions that are tried, over half a turn
_FAR = 0.1  # of the size: farther images count as this far, so that one raised arm changes little
_STEPS = 60  # of the refinement of one plane
_APART = 0.97  # cosine between the normals of two planes: 14 degrees


@dataclass(frozen=True, slots=True, eq=False)
class MirrorPlane:
    """A vertical plane: the points p with normal @ p = offset.

    Attributes:
        normal: (3,) unit, horizontal: its y is 0.
        offset: along the normal, in the unit of the points.
        asymmetry: mean distance from the mirror images of a surface's points to the surface, in
            shares of the surface's largest extent; 0 for a perfect mirror image.
    """

    normal: Array
    offset: float
    asymmetry: float

    def distance(self, points: Array) -> Array:
        """Signed distances (n,) of points (n, 3): positive on the normal's side."""
        away: Array = points @ self.normal - self.offset
        return away

    def mirrored(self, points: Array) -> Array:
        """The mirror images of points (n, 3)."""
        image: Array = points - 2.0 * self.distance(points)[:, None] * self.normal
        return image


def mirror_planes(points: Array, count: int) -> list[MirrorPlane]:
    """Return up to `count` vertical planes about which a surface is most symmetric, best first.

    Each is the best of its neighbourhood in direction and offset. The same points always give the
    same planes.

    Args:
        points: (n, 3) spread evenly over the surface, +Y up, not all on one vertical line.
        count: the most planes.
    """
    size = float(np.ptp(points, axis=0).max())
    surface = cKDTree(points)
    probes = points[:: max(1, len(points) // _PROBES)]
    spacing = float(surface.query(probes, k=2)[0][:, 1].mean()) / size

    def asymmetry(yaw: float, offset: float) -> float:
        images = MirrorPlane(_normal(yaw), offset * size, 0.0).mirrored(probes)
        gaps = np.minimum(surface.query(images)[0] / size, _FAR)
        return max(float(gaps.mean()) - spacing, 0.0)

    yaws = np.arange(_YAWS) * (np.pi / _YAWS)
    starts = []
    for yaw in yaws:
        along = points @ _normal(yaw) / size
        offsets = {float(along.mean()), float(np.median(along)), (along.min() + along.max()) / 2.0}
        starts.append(min((asymmetry(yaw, offset), offset) for offset in sorted(offsets)))
    values = np.array([value for value, _ in starts])
    lowest = (values <= np.roll(values, 1)) & (values <= np.roll(values, -1))
    chosen = sorted(np.flatnonzero(lowest), key=lambda index: (values[index], index))[: 2 * count]
    found = [_refined(asymmetry, yaws[index], starts[index][1], size) for index in chosen]
    planes: list[MirrorPlane] = []
    for plane in sorted(found, key=lambda plane: plane.asymmetry):
        if all(abs(plane.normal @ other.normal) < _APART for other in planes):
            planes.append(plane)
    return planes[:count]


def _refined(
    asymmetry: Callable[[float, float], float], yaw: float, offset: float, size: float
) -> MirrorPlane:
    step = np.pi / _YAWS / 2.0
    simplex = np.array([[yaw, offset], [yaw + step, offset], [yaw, offset + 0.01]])
    best = minimize(
        lambda at: asymmetry(at[0], at[1]),
        simplex[0],
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": _STEPS},
    )
    return MirrorPlane(_normal(best.x[0]), float(best.x[1]) * size, float(best.fun))


def _normal(yaw: float) -> Array:
    """The horizontal unit vector at an angle [rad] from +X towards -Z."""
    return np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
