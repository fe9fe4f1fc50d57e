"""Cotangent weights and the Laplacian of any triangle mesh, degenerate ones included.

Source: Pinkall and Polthier 1993, Computing discrete minimal surfaces, eq. (8); Meyer et al. 2003,
Discrete differential-geometry operators, section 3.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# The least twice-the-area of a triangle, as a share of its longest edge squared. A flatter triangle
# counts as this fat, which bounds its cotangents by 1000.
_LEAST_FATNESS = 1e-3

# The least weight of an edge. It keeps every connected mesh connected for the solver (an edge
# between two right angles weighs zero), and is too small to be seen in the answer; it is also large
# enough that rounding, divided by it, stays below 1e-9.
LEAST_WEIGHT = 1e-6


def half_cotangents(vertices: Floats, faces: Ints) -> Floats:
    """Half the cotangent of each corner's angle, (F, 3); the weight that its opposite edge gets.

    All three cotangents of a sliver share one bounded denominator. This keeps their pairwise
    products summing to a positive number, that is, the face's Dirichlet energy stays positive
    semi-definite, which clamping each of them alone would not. A face that is a point or names a
    vertex twice gets zeros.
    """
    corners = vertices[faces]  # (F, 3, 3)
    to_next = np.roll(corners, -1, axis=1) - corners
    to_previous = np.roll(corners, 1, axis=1) - corners
    dots = np.einsum("fck,fck->fc", to_next, to_previous)
    area2 = np.linalg.norm(np.cross(to_next[:, 0], to_previous[:, 0]), axis=1)
    longest2 = np.einsum("fck,fck->fc", to_next, to_next).max(axis=1, initial=0.0)
    denominator = np.maximum(area2, _LEAST_FATNESS * longest2)
    is_face = (denominator > 0.0) & _corners_differ(faces)
    halves = np.zeros((len(faces), 3))
    np.divide(0.5 * dots, denominator[:, None], out=halves, where=is_face[:, None])
    return halves


def _corners_differ(faces: Ints) -> NDArray[np.bool_]:
    a, b, c = faces[:, 0], faces[:, 1], faces[:, 2]
    differ: NDArray[np.bool_] = (a != b) & (b != c) & (c != a)
    return differ


@dataclass(frozen=True, slots=True)
class WeightedEdges:
    """The undirected edges of a mesh: vertex pairs (E, 2), lower index first, and weights (E,)."""

    pairs: Ints
    weights: Floats


def sum_over_faces(faces: Ints, face_weights: Floats, count: int) -> WeightedEdges:
    """Edges of a mesh of `count` vertices, each weighing what its one, two or more faces give it.

    `face_weights` (F, 3) belongs to the edge opposite each corner, as in `half_cotangents`.
    """
    proper = _corners_differ(faces)
    tails = np.roll(faces[proper], -1, axis=1).ravel()
    heads = np.roll(faces[proper], -2, axis=1).ravel()
    keys = np.minimum(tails, heads) * count + np.maximum(tails, heads)
    unique, edge_of = np.unique(keys, return_inverse=True)
    weights = weighted_sums(edge_of, face_weights[proper].ravel(), len(unique))
    return WeightedEdges(np.stack([unique // count, unique % count], axis=1), weights)


def weighted_sums(slots: Ints, weights: Floats, count: int) -> Floats:
    """Sums (count,) of the weights that go into each slot."""
    return np.bincount(slots, weights, minlength=count).astype(np.float64, copy=False)


def cotangent_edges(vertices: Floats, faces: Ints) -> WeightedEdges:
    """Edges with half the sum of the cotangents opposite, none below `LEAST_WEIGHT`.

    An edge whose opposite angles sum to more than half a turn would weigh less than nothing; it
    gets the least weight, and so the Laplacian obeys the maximum principle on any mesh.
    """
    edges = sum_over_faces(faces, half_cotangents(vertices, faces), len(vertices))
    return WeightedEdges(edges.pairs, np.maximum(edges.weights, LEAST_WEIGHT))


def graph_laplacian(edges: WeightedEdges, count: int) -> sp.csr_matrix:
    """The Laplacian (N, N) of weighted edges: symmetric, rows sum to zero, diagonal positive."""
    i, j = edges.pairs[:, 0], edges.pairs[:, 1]
    tails, heads, weights = np.append(i, j), np.append(j, i), np.tile(edges.weights, 2)
    every = np.arange(count)  # with its diagonal entry, a vertex without an edge too
    return sp.coo_matrix(
        (
            np.concatenate([-weights, weighted_sums(tails, weights, count)]),
            (np.concatenate([tails, every]), np.concatenate([heads, every])),
        ),
        shape=(count, count),
    ).tocsr()


def cotangent_laplacian(vertices: Floats, faces: Ints) -> sp.csr_matrix:
    """The positive semi-definite cotangent Laplacian (N, N); libigl's `cotmatrix` is its negative.

    Source: Pinkall and Polthier 1993, eq. (8). Slivers are bounded and negative edge weights
    raised to the least positive one: see `cotangent_edges`.
    """
    vertices = np.asarray(vertices, dtype=np.float64)
    faces = np.asarray(faces, dtype=np.int64)
    return graph_laplacian(cotangent_edges(vertices, faces), len(vertices))
