"""The edge graph of a surface: welded, reduced, and joined between pieces that do not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

_GRAPH_VERTICES = 1200  # local separators cost more than linear time
_MOST_PIECES = 64
_SAME = 1e-5  # vertices closer than this are one
# A surface has no clear inside if it has more openings than _OPENINGS, which are together longer
# than _OPEN times the root of its area.
_OPENINGS = 2
_OPEN = 1.5

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class SpaceGraph:
    """An undirected graph in space: positions (n, 3) and edges (e, 2)."""

    positions: FloatArray
    edges: IntArray

    def neighbours(self) -> list[list[int]]:
        """Return the neighbours of each node."""
        lists: list[list[int]] = [[] for _ in self.positions]
        for a, b in self.edges.tolist():
            lists[a].append(b)
            lists[b].append(a)
        return lists

    def ends(self) -> list[int]:
        """Nodes at which chains end: forks and tips."""
        return [node for node, near in enumerate(self.neighbours()) if len(near) != 2]


def welded(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Merge vertices at the same place, and drop faces that use a vertex twice."""
    _, first, group = np.unique(
        np.round(points / _SAME), axis=0, return_index=True, return_inverse=True
    )
    triangles = group.reshape(-1)[triangles]
    a, b, c = triangles.T
    return unpinched(points[first], triangles[(a != b) & (b != c) & (c != a)])


def unpinched(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Split vertices at which several fans of faces meet, so that touching knees are apart."""
    corners = np.arange(triangles.size).reshape(-1, 3)
    pairs = corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends = triangles.reshape(-1)[pairs]
    pairs = np.take_along_axis(pairs, np.argsort(ends, axis=1), axis=1)
    ends.sort(axis=1)
    order = np.lexsort(ends.T)
    shared = (ends[order][1:] == ends[order][:-1]).all(axis=1)
    links = np.stack([pairs[order][:-1][shared], pairs[order][1:][shared]], axis=-1)
    fans: IntArray = component_labels(triangles.size, links.reshape(-1, 2))
    _, first = np.unique(fans, return_index=True)
    return points[triangles.reshape(-1)[first]], fans.reshape(-1, 3)


def border_edges(triangles: IntArray) -> IntArray:
    """Return the edges (b, 2) that do not lie between exactly two faces."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, faces = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(edges[faces != 2], dtype=np.int64)


def has_inside(points: FloatArray, triangles: IntArray, border: IntArray) -> bool:
    """Whether the surface is one piece, apart from details, with few or small openings."""
    open_length = np.linalg.norm(points[border[:, 0]] - points[border[:, 1]], axis=1).sum()
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normals, axis=1).sum()
    labels = component_labels(len(points), np.vstack([triangles[:, :2], triangles[:, 1:]]))
    pieces = len(np.unique(labels[_significant(points, labels)]))
    openings = len(np.unique(component_labels(len(points), border)[border]))
    return pieces == 1 and bool(openings <= _OPENINGS or open_length < _OPEN * np.sqrt(area))


def reduced(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Reduce the surface to about `_GRAPH_VERTICES` vertices."""
    if len(points) <= _GRAPH_VERTICES:
        return points, triangles
    try:
        import fast_simplification  # noqa: PLC0415  # an optional extra
    except ImportError as error:
        raise ImportError("curve skeletons need: pip install 'bunraku[characters]'") from error
    fewer_points, fewer = fast_simplification.simplify(
        np.ascontiguousarray(points, dtype=np.float32),
        np.ascontiguousarray(triangles, dtype=np.int32),
        target_count=2 * _GRAPH_VERTICES,
    )
    used, compact = np.unique(fewer, return_inverse=True)
    if len(used) == 0:
        return points, triangles
    return unpinched(fewer_points[used].astype(np.float64), compact.reshape(-1, 3))


def surface_graph(points: FloatArray, triangles: IntArray) -> SpaceGraph:
    """Return the graph of the surface's edges, with separate pieces joined by bridges."""
    edges = unique_edges(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
    labels = component_labels(len(points), edges)
    kept = _significant(points, labels)
    renumber = np.full(len(points), -1)
    renumber[kept] = np.arange(len(kept))
    edges = renumber[edges]
    edges = edges[(edges >= 0).all(axis=1)]
    return SpaceGraph(points[kept], np.vstack([edges, bridges(points[kept], labels[kept])]))


def unique_edges(pairs: IntArray) -> IntArray:
    """Return the different edges among pairs of nodes (p, 2), without edges to the same node."""
    return np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0).astype(np.int64)


def component_labels(count: int, edges: IntArray) -> IntArray:
    """Return the connected component (count,) of each node of a graph with these edges (e, 2)."""
    links = edge_matrix(count, edges, np.ones(len(edges)))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def edge_matrix(count: int, edges: IntArray, values: FloatArray) -> csr_array:
    """Return a sparse matrix (count, count) with values (e,) at edges (e, 2)."""
    links = coo_array((values, (edges[:, 0], edges[:, 1])), shape=(count, count))
    return csr_array(links)


def _significant(points: FloatArray, labels: IntArray) -> IntArray:
    """Vertices of the pieces that form the shape: no eyes, buttons or stray triangles."""
    count = int(labels.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, labels, points)
    np.maximum.at(high, labels, points)
    sizes = np.linalg.norm(high - low, axis=1)
    ranked = np.argsort(-sizes, kind="stable")[:_MOST_PIECES]
    large = ranked[sizes[ranked] >= 0.05 * np.linalg.norm(np.ptp(points, axis=0))]
    return np.flatnonzero(np.isin(labels, large if len(large) else ranked[:1]))


def bridges(points: FloatArray, labels: IntArray) -> IntArray:
    """Return edges across the shortest gaps that join all pieces (a minimum spanning tree)."""
    pieces = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    trees = [cKDTree(points[piece]) for piece in pieces]
    gaps = np.zeros((len(pieces), len(pieces)))
    ends = {}
    for i, piece in enumerate(pieces):
        for j in range(i):
            distance, nearest = trees[j].query(points[piece])
            k = int(np.argmin(distance))
            gaps[i, j] = distance[k] + 1e-9
            ends[i, j] = (int(piece[k]), int(pieces[j][nearest[k]]))
    joined = minimum_spanning_tree(gaps).tocoo()
    pairs = [ends[i, j] for i, j in zip(joined.row.tolist(), joined.col.tolist(), strict=True)]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
