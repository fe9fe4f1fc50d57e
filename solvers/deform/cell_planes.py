"""The plane of each cell at rest, in which squash and stretch finds the cell's primary axis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.linear.laplacian import Floats, Ints, weighted_sums

# The least extent of a cell along its second axis, as a share of the first. A cell whose edges are
# nearly on one line has no usable stretch across it.
_THIN = 1e-3


class Planes(NamedTuple):
    """Constants of each cell at rest; a named tuple, because compiled kernels accept those.

    `extents` (N, 2) is trace C of the rest covariance C, and its inverse or 0. `axes` (N, 6) are
    two orthonormal rest directions that span the cell's edges best, and `shares` (N, 4), for each
    of them, the inverse root of its extent, damped, and what the damping took away.
    """

    extents: Floats
    axes: Floats
    shares: Floats


def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """The sum of the area vectors around each vertex (N, 3), over the sum of the areas."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    vectors = np.cross(b - a, c - a)
    areas = np.linalg.norm(vectors, axis=1)
    around = np.column_stack([vectors, areas]).T
    corners = faces.T.ravel()
    sums = np.stack([weighted_sums(corners, np.tile(s, 3), len(vertices)) for s in around], axis=1)
    return sums[:, :3] / np.maximum(sums[:, 3:], 1e-300)


def _least_axis(C: Floats, strength: Floats, normals: Floats) -> Floats:
    """The normal of each plane (N, 3): the given one, or C's least axis where that is zero."""
    pulled = C - strength[:, None, None] * normals[:, :, None] * normals[:, None, :]
    _, vectors = np.linalg.eigh(pulled)
    least: Floats = vectors[:, :, 0]
    return least


def _axes_across(normals: Floats, C: Floats) -> tuple[Floats, Floats]:
    """The axes (N, 2, 3) of C in the planes of these normals, greater extent first, and extents."""
    every = np.arange(len(normals))
    flattest = np.abs(normals).argmin(axis=1)
    u = -normals * normals[every, flattest, None]
    u[every, flattest] += 1.0
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normals, u)
    Cu, Cv = np.einsum("nij,nj->ni", C, u), np.einsum("nij,nj->ni", C, v)
    uu, uv, vv = (np.einsum("ni,ni->n", a, b) for a, b in ((u, Cu), (u, Cv), (v, Cv)))
    turn = 0.5 * np.arctan2(2.0 * uv, uu - vv)[:, None]
    axes = np.stack([np.cos(turn) * u + np.sin(turn) * v, np.cos(turn) * v - np.sin(turn) * u], 1)
    mean, half = 0.5 * (uu + vv), np.hypot(0.5 * (uu - vv), uv)
    return axes, np.maximum(np.stack([mean + half, mean - half], axis=1), 0.0)


def cell_planes(C: Floats, normals: Floats) -> Planes:
    """The planes of the cells, from their covariances at rest (N, 3, 3) and normals (N, 3).

    The normal defines a cell's plane: on the edge of a box it is well defined, while the second
    axis of the covariance is not. Where the faces have no common side, the covariance defines it.
    """
    extents = np.trace(C, axis1=1, axis2=2)
    normals = _least_axis(C, 10.0 * extents, normals)
    axes, pair = _axes_across(normals, C)
    damped = pair**2 + (_THIN * pair.max(axis=1, keepdims=True)) ** 2
    weights = np.sqrt(np.divide(pair, damped, out=np.zeros_like(pair), where=damped > 0.0))
    inverse = np.divide(1.0, extents, out=np.zeros_like(extents), where=extents > 1e-200)
    return Planes(
        extents=np.column_stack([extents, inverse]),
        axes=axes.reshape(-1, 6),
        shares=np.concatenate([weights, 1.0 - weights**2 * pair], axis=1),
    )
