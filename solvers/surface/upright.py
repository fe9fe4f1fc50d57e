"""Estimates from its shape which side of a surface is up, and whether it faces backwards.

Three signs, as in Fu, Cohen-Or, Dror and Sheffer 2008, "Upright Orientation of Man-Made Objects",
ACM TOG 27(3), section 4: a standing object is stable, it is less symmetric between above and below
than between front and back, and a figure is tall. Only the two conventions of mesh files are
distinguished, +Y up and +Z up. The weights were set by eye on figures, animals and vehicles.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

FloatArray = NDArray[np.float64]

SAMPLES = 8000
X, Y, Z = range(3)

_FLAT = 1e-3  # of the largest extent: a thinner surface is a sheet
_ROD = 0.15  # of the largest extent: a rod, thinner in both other extents, keeps +Y up
_SOLE = 0.03  # of the height: the part that touches the ground
_SURE = 0.25  # the least score for +Z; below it, +Y is up as in most files
_TALL = 0.5  # of the logarithm of a ratio of extents: an animal may be longer than tall
_TOES, _ANKLES = 0.05, (0.07, 0.14)  # of the height


def surface_samples(vertices: FloatArray, faces: NDArray[np.int64]) -> FloatArray:
    """Return `SAMPLES` points (n, 3) spread evenly over the faces (F, 3), always the same ones."""
    corners = vertices[faces]
    edges = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    if not areas.sum() > 0.0:
        return corners.reshape(-1, 3)
    random = np.random.default_rng(0)
    face = random.choice(len(faces), SAMPLES, p=areas / areas.sum())
    u, v = random.random((2, SAMPLES, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points: FloatArray = corners[face, 0] + u * edges[face, 0] + v * edges[face, 1]
    return points


def flat_axis(points: FloatArray) -> int | None:
    """Return the axis along which points (n, 3) have no extent, or None if they are no sheet."""
    extent = np.ptp(points, axis=0)
    thin = int(np.argmin(extent))
    return thin if extent[thin] <= _FLAT * extent.max() else None


def stands_along_z(points: FloatArray) -> bool:
    """Return whether +Z, not +Y, is up for points (n, 3) on a surface; False in doubt."""
    extent = np.ptp(points, axis=0)
    if np.sort(extent)[1] < _ROD * extent.max():
        return False
    unit = points / np.linalg.norm(extent)
    lopsided = np.log((_asymmetry(unit, Z) + 1e-6) / (_asymmetry(unit, Y) + 1e-6))
    steadier = np.clip(_stability(unit, Z) - _stability(unit, Y), -0.1, 0.1)
    taller = np.log(extent[Z] / extent[Y])
    standing = np.sign(taller) * max(abs(taller) - _TALL, 0.0)
    return bool(lopsided + 5.0 * steadier + 0.5 * standing > _SURE)


def faces_away(points: FloatArray) -> bool:
    """Return whether a tall figure, +Y up and symmetric, has its toes at the back, -Z.

    Both the middle and the ends of the feet must lie behind the ankles.
    """
    extent = np.ptp(points, axis=0)
    if extent[Y] < 0.7 * extent.max():
        return False
    unit = points / np.linalg.norm(extent)
    if _asymmetry(unit, X) > 0.6 * _asymmetry(unit, Z):
        return False
    height = (points[:, Y] - points[:, Y].min()) / extent[Y]
    depth = points[:, Z] / extent[Y]
    toes = depth[height < _TOES]
    ankles = depth[(height > _ANKLES[0]) & (height < _ANKLES[1])]
    if len(toes) < 20 or len(ankles) < 20:
        return False
    back, front = (np.percentile(toes, q) - np.percentile(ankles, q) for q in (5, 95))
    return bool(toes.mean() - ankles.mean() < -0.02 and back + front < -0.04)


def _asymmetry(points: FloatArray, axis: int) -> float:
    """Mean distance from the mirror image, in the plane across `axis`, to the nearest points."""
    mirrored = points.copy()
    mirrored[:, axis] = 2.0 * points[:, axis].mean() - points[:, axis]
    return float(cKDTree(points).query(mirrored, workers=2)[0].mean())


def _stability(points: FloatArray, axis: int) -> float:
    """How far inside the contact area with the ground the centre lies, along `axis`; -1 if none."""
    height = points[:, axis] - points[:, axis].min()
    across = np.delete(points, axis, axis=1)
    sole = across[height <= _SOLE * height.max()]
    with suppress(QhullError):
        sides = ConvexHull(sole).equations
        return float(-(sides[:, :2] @ across.mean(axis=0) + sides[:, 2]).max())
    return -1.0
