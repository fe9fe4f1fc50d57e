"""Moves a dense surface with a coarse one; its detail rotates with the coarse surface.

Each dense vertex p belongs to a point q = sum w_k v_k of a coarse triangle, with the detail
d = p - q. When the coarse vertices v_k move to x_k and the surface around them rotates by R_k, the
dense vertex moves to

    sum_k w_k (x_k + R_k ((q - v_k) / 2 + d)).

This is the mean of the triangle's prediction, sum w_k (x_k + R_k d), and of the corners' separate
predictions, sum w_k (x_k + R_k (p - v_k)). Their errors cancel to second order, so bends are round
and show no facets (James 2020, Phong deformation: a better C0 interpolant for embedded deformation,
section 3; there in tetrahedra). A rigid motion of the coarse surface is followed exactly, whatever
the weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import KDTree

from solvers.linear.laplacian import cotangent_edges
from solvers.surface.embedding_kernels import (
    FRAME,
    Places,
    Rings,
    Triangles,
    bind_locally,
    fit_frames,
    follow_frames,
)

MOST_VERTICES = 1 << 16  # of a coarse surface, whose indices have two bytes
_FLAT = 1e-6  # least second extent of a ring of edges, as a share of the first; less is a line

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Embedding:
    """The places of dense vertices on a coarse surface; compact, because every frame reads them.

    A vertex takes 26 bytes.

    Attributes:
        corners: (N, 3) the coarse vertices of each dense vertex's triangle.
        weights: (N, 2) of the second and third corner; all three are in [0, 1] and sum to 1.
        details: (N, 3) from the place in the triangle to the dense vertex, at rest.
    """

    corners: NDArray[np.uint16]
    weights: Singles
    details: Singles


def embed(points: Floats, cluster: Ints, vertices: Floats, faces: Ints) -> Embedding:
    """Find each point's place on a surface, starting at the point's own vertex of the surface.

    The search for the nearest triangle goes from neighbour to neighbour, never across a gap: a
    finger is bound to itself, however near the next finger is.

    Args:
        points: (N, 3).
        cluster: (N,) the vertex of each point; a point of -1 moves rigidly with the nearest vertex.
        vertices: (C, 3), at most `MOST_VERTICES`.
        faces: (F, 3).

    Raises:
        ValueError: no vertices, or too many.
    """
    if not 0 < len(vertices) <= MOST_VERTICES:
        raise ValueError(f"expected 1 to {MOST_VERTICES} coarse vertices, got {len(vertices)}")
    order = np.argsort(faces, axis=None, kind="stable")
    first = np.searchsorted(faces.ravel()[order], np.arange(len(vertices) + 1))
    surface = Triangles(
        np.ascontiguousarray(vertices), np.ascontiguousarray(faces), first, order // 3
    )
    count = len(points)
    places = Places(
        np.ascontiguousarray(points),
        np.full(count, -1),
        np.zeros((count, 3)),
        np.full(count, np.inf),
    )
    bind_locally(surface, cluster, places)
    corners = np.zeros((len(points), 3), dtype=np.int64)
    bound = places.triangle >= 0
    corners[bound] = faces[places.triangle[bound]]
    corners[~bound] = _nearest(points[~bound], vertices)[:, None]
    weights = places.weights[:, 1:].astype(np.float32)  # the detail corrects the rounding
    shares = np.column_stack([1.0 - weights.sum(axis=1, dtype=np.float64), weights])
    on_it = np.einsum("nk,nkj->nj", shares, vertices[corners])
    return Embedding(corners.astype(np.uint16), weights, (points - on_it).astype(np.float32))


def _nearest(points: Floats, vertices: Floats) -> Ints:
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    return np.asarray(KDTree(vertices).query(points)[1], dtype=np.int64)


class DenseSurface:
    """Moves the N vertices of a dense surface with the C vertices of a coarse one.

    It has no memory between frames. Only the constructor allocates arrays.

    Args:
        embedding: the places of the dense vertices on the coarse surface.
        vertices: (C, 3) the coarse surface at rest.
        faces: (F, 3) its triangles.
    """

    def __init__(self, embedding: Embedding, vertices: Floats, faces: Ints) -> None:
        self.embedding = embedding
        self._rings = _rings(np.ascontiguousarray(vertices, dtype=np.float64), faces)
        self._frames = np.empty((len(vertices), FRAME))

    def follow(self, moved: Floats, out: Floats | Singles) -> None:
        """Write the dense vertices for coarse vertices `moved` (C, 3) to `out` (N, 3).

        Raises:
            ValueError: for arrays of another shape.
        """
        for name, array, like in (
            ("moved", moved, self._rings.rest),
            ("out", out, self.embedding.details),
        ):
            if array.shape != like.shape:
                raise ValueError(f"expected `{name}` of shape {like.shape}, got {array.shape}")
        fit_frames(moved, self._rings, self._frames)
        held = self.embedding
        follow_frames(self._frames, held.corners, held.weights, held.details, out)

    @property
    def bytes_moved(self) -> int:
        """The bytes that one `follow` into float64 must read and write."""
        held, rings = self.embedding, self._rings
        dense = held.corners.nbytes + held.weights.nbytes + held.details.nbytes
        coarse = sum(array.nbytes for array in rings) + rings.rest.nbytes + self._frames.nbytes
        return dense + 24 * len(held.corners) + coarse


def _rings(rest: Floats, faces: Ints) -> Rings:
    """The neighbours of each vertex, and edges to them weighted by cotangents.

    If a vertex's neighbours lie on one line, its rotation would be ambiguous; then the neighbours'
    neighbours are added.
    """
    count = len(rest)
    weighted = cotangent_edges(rest, faces)
    i, j = weighted.pairs.T
    graph = sp.coo_matrix((weighted.weights, (i, j)), shape=(count, count)).tocsr()
    graph = sp.csr_matrix(graph + graph.T)
    tails = np.repeat(np.arange(count), np.diff(graph.indptr))
    edges = rest[graph.indices] - rest[tails]
    moment = np.zeros((count, 3, 3))
    np.add.at(moment, tails, graph.data[:, None, None] * edges[:, :, None] * edges[:, None, :])
    extents = np.linalg.eigvalsh(moment)
    open_turn = np.flatnonzero(extents[:, 1] <= _FLAT * extents[:, 2])
    if len(open_turn):
        farther = sp.diags_array(np.isin(np.arange(count), open_turn).astype(float)) @ graph @ graph
        graph = sp.csr_matrix(graph + farther)
        graph.setdiag(0.0)
        graph.eliminate_zeros()
    graph.sort_indices()
    tails = np.repeat(np.arange(count), np.diff(graph.indptr))
    edges = graph.data[:, None] * (rest[graph.indices] - rest[tails])
    return Rings(rest, graph.indptr.astype(np.uint32), graph.indices.astype(np.uint32), edges)
