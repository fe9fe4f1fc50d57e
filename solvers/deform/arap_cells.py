"""The cells of an ARAP energy in memory, for the local and the global step.

A cell is a vertex with the edges that one rotation R should fit: the spokes around the vertex
(Sorkine and Alexa 2007, eq. (3)), or the spokes and the rims of its faces (Chao et al. 2010,
section 4). Both follow one formula. With rest edges e and deformed edges e' of weight w, cell c
fits its rotation to

    S_c = sum over its edges of w e' e^T = sum over its vertices j of (x_j - x_c) u_cj^T

and pulls vertex j by R_c u_cj in the linear system of the global step. The vectors u depend only on
the rest pose, so both energies use the same kernels at the same cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.linear.laplacian import (
    Floats,
    Ints,
    WeightedEdges,
    cotangent_edges,
    graph_laplacian,
    half_cotangents,
    sum_over_faces,
    weighted_sums,
)

SPOKES = "spokes"
SPOKES_AND_RIMS = "spokes-and-rims"

# Added to each face's share of an edge weight. A share may be negative, but not a face's energy,
# which is that of a finite element. This number makes the energy positive for any face.
_LEAST_HALF = 1e-8


class Terms(NamedTuple):
    """The energy's terms: each is an edge, tail minus head, in one cell, with its weight; (T,)."""

    cells: Ints
    tails: Ints
    heads: Ints
    weights: Floats


class Cells(NamedTuple):
    """Cells of N vertices as compressed rows of M half-edges (c, j), j ascending.

    `fits` (M, 4) holds u_cj and the edge's weight in the Laplacian; `pulls` (M, 3) holds u_jc;
    `own` (N, 3) is u_cc, minus the sum of the row's u_cj. All u are divided by the number of cells
    that share an edge, so that the global step's matrix is the Laplacian itself. A named tuple,
    because compiled kernels accept named tuples.
    """

    starts: NDArray[np.uint32]
    neighbours: NDArray[np.uint32]
    fits: Floats
    pulls: Floats
    own: Floats


@dataclass(frozen=True, slots=True)
class CellMesh:
    """The constants of a mesh at rest that a deformation needs.

    `laplacian` is (N, N); `sharing` is the number of cells that contain an edge.
    """

    cells: Cells
    terms: Terms
    laplacian: sp.csr_matrix
    sharing: int


def build_cells(vertices: Floats, faces: Ints, energy: str) -> CellMesh:
    """Build the cells of a mesh at rest, with vertices (N, 3) and faces (F, 3)."""
    if energy == SPOKES:
        edges = cotangent_edges(vertices, faces)
        return _lay_out(vertices, edges, _spokes(edges), sharing=2)
    halves = half_cotangents(vertices, faces) + _LEAST_HALF
    edges = sum_over_faces(faces, halves, len(vertices))
    return _lay_out(vertices, edges, _spokes_and_rims(faces, halves), sharing=3)


def _spokes(edges: WeightedEdges) -> Terms:
    i, j = edges.pairs[:, 0], edges.pairs[:, 1]
    ends, others = np.concatenate([i, j]), np.concatenate([j, i])
    return Terms(ends, ends, others, np.tile(edges.weights, 2))


def _spokes_and_rims(faces: Ints, halves: Floats) -> Terms:
    """Three edges of every face, each in the cells of the face's three corners."""
    proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces, halves = faces[proper], halves[proper]
    tails, heads = np.roll(faces, -1, axis=1), np.roll(faces, -2, axis=1)
    cells = np.concatenate([np.repeat(faces[:, c : c + 1], 3, axis=1) for c in range(3)])
    return Terms(
        cells.ravel(),
        np.tile(tails, (3, 1)).ravel(),
        np.tile(heads, (3, 1)).ravel(),
        np.tile(halves, (3, 1)).ravel(),
    )


def _lay_out(vertices: Floats, edges: WeightedEdges, terms: Terms, *, sharing: int) -> CellMesh:
    count = len(vertices)
    i, j = edges.pairs[:, 0], edges.pairs[:, 1]
    keys = np.concatenate([i * count + j, j * count + i])
    order = np.argsort(keys, kind="stable")
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    twins = np.roll(place, len(i))[order]  # among the keys j -> i lies half a turn from i -> j
    keys = keys[order]
    cells, neighbours = keys // count, keys % count

    pull = (terms.weights / sharing)[:, None] * (vertices[terms.tails] - vertices[terms.heads])
    u = np.zeros((len(keys), 3))
    for ends, sign in ((terms.tails, 1.0), (terms.heads, -1.0)):
        outer = ends != terms.cells
        slots = np.searchsorted(keys, terms.cells[outer] * count + ends[outer])
        for axis in range(3):
            u[:, axis] += weighted_sums(slots, sign * pull[outer, axis], len(keys))
    own = np.stack([-weighted_sums(cells, u[:, axis], count) for axis in range(3)], axis=1)
    weights = np.tile(edges.weights, 2)[order]
    half_edges = Cells(
        starts=np.searchsorted(cells, np.arange(count + 1)).astype(np.uint32),
        neighbours=neighbours.astype(np.uint32),
        fits=np.ascontiguousarray(np.column_stack([u, weights])),
        pulls=np.ascontiguousarray(u[twins]),
        own=own,
    )
    return CellMesh(half_edges, terms, graph_laplacian(edges, count), sharing)


def surface_area(points: Floats, faces: Ints) -> float:
    """Return the area of a surface of triangles (F, 3) between points (N, 3)."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
