"""Input checks of a deformation solver, and the order in which it stores the vertices.

The order is that of the factor, so neighbours lie near each other in memory. It does not depend on
the handles, which may change.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from solvers.kernels.compiled import kernel
from solvers.linear.laplacian import Floats, Ints
from solvers.linear.nested_dissection import Dissection, dissect

_FARTHEST = 1e9  # the farthest target, in sizes of the mesh; keeps every square finite


@dataclass(frozen=True, slots=True)
class UnitBox:
    """A centre (3,) and a size that bring a mesh of any unit to coordinates of about one."""

    centre: Floats
    size: float

    @classmethod
    def around(cls, points: Floats) -> UnitBox:
        """The bounding box of a point set (N, 3); a set of one point has size one."""
        low, high = points.min(axis=0), points.max(axis=0)
        size = float(np.linalg.norm(high - low))
        return cls(low + 0.5 * (high - low), size if size > 0.0 else 1.0)

    def inside(self, points: Floats) -> Floats:
        """Return points (N, 3) in the box's coordinates."""
        return (points - self.centre) / self.size


@dataclass(frozen=True, slots=True)
class Layout:
    """The order in which a solver stores N vertices.

    Vertex order[i] is stored at i; place[v] is the place of vertex v. `faces` (F, 3) and `parts`
    (N,), the connected component of each vertex, use the places; `tree` is the dissection that
    defines the order.
    """

    order: Ints
    place: Ints
    faces: Ints
    parts: Ints
    tree: Dissection


def checked_mesh(vertices: ArrayLike, faces: ArrayLike) -> tuple[Floats, Ints]:
    """Return vertices (N, 3) and faces (F, 3), or raise a ValueError that states the fault."""
    points = np.asarray(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise ValueError(f"expected vertices of shape (N, 3), N > 0, got {points.shape}")
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise ValueError(f"vertex {bad} is not finite: {points[bad]}")
    if np.abs(points).max() > 1e100:
        raise ValueError("vertices beyond 1e100 are out of range")
    triangles = checked_integers(faces, "faces").reshape(-1, 3) if np.size(faces) == 0 else faces
    triangles = checked_integers(triangles, "faces")
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"expected faces of shape (F, 3), got {triangles.shape}")
    check_range(triangles, len(points), "faces")
    return points, triangles


def checked_regions(region_of: ArrayLike, rigidity: ArrayLike, count: int) -> tuple[Ints, Floats]:
    """Return regions (N,) and rigidities (N,), or raise a ValueError that states the fault."""
    regions = checked_integers(region_of, "regions")
    shares = np.asarray(rigidity, dtype=np.float64)
    for name, values in (("regions", regions), ("rigidity", shares)):
        if values.shape != (count,):
            raise ValueError(f"expected {name} of shape ({count},), got {values.shape}")
    if not ((shares >= 0.0) & (shares <= 1.0)).all():
        raise ValueError("expected a rigidity in [0, 1] at every vertex")
    return regions, shares


def checked_targets(targets: ArrayLike, count: int, box: UnitBox) -> Floats:
    """Return targets (H, 3), or raise a ValueError that states the fault."""
    points = np.asarray(targets, dtype=np.float64)
    if points.shape != (count, 3):
        raise ValueError(f"expected targets of shape ({count}, 3), got {points.shape}")
    points = np.ascontiguousarray(points)
    bad = _first_beyond(points, box.centre, _FARTHEST * box.size)
    if bad >= 0:
        raise ValueError(f"target {bad} is not finite, or absurdly far away: {points[bad]}")
    return points


def check_steps(iterations: int) -> None:
    """Raise a ValueError for a number of iterations below zero."""
    if iterations < 0:
        raise ValueError(f"iterations must not be negative, got {iterations}")


@kernel
def _first_beyond(points: Floats, centre: Floats, most: float) -> int:
    """The index of the first point farther than `most` from the centre on some axis, or -1."""
    for h in range(len(points)):
        for axis in range(3):
            if not abs(points[h, axis] - centre[axis]) <= most:  # true for NaN
                return h
    return -1


def lay_out(points: Floats, faces: Ints) -> Layout:
    """Choose the order in which the vertices at `points` (N, 3) are stored."""
    count = len(points)
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    graph = sp.coo_matrix((np.ones(len(tails)), (tails, heads)), shape=(count, count)).tocsr()
    graph = sp.csr_matrix(graph + graph.T)
    _, part_of = connected_components(graph, directed=False)
    tree = dissect(graph, points)
    order = tree.order.astype(np.int64)
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    return Layout(order, place, place[faces], part_of[order], tree)


def checked_integers(values: ArrayLike, name: str) -> Ints:
    """Return an array of integers, or raise a ValueError that names it."""
    array = np.asarray(values)
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"expected integer {name}, got {array.dtype}")
    return array.astype(np.int64)


def check_range(indices: Ints, count: int, name: str) -> None:
    """Raise a ValueError if an index does not name one of `count` vertices."""
    if indices.size and (indices.min() < 0 or indices.max() >= count):
        bad = indices[(indices < 0) | (indices >= count)].ravel()[0]
        raise ValueError(f"{name} name vertex {bad}, but there are {count} vertices")
