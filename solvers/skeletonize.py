"""The curve skeleton of any surface: local separators of its edge graph, made into a clean tree.

A local separator is a small set of vertices whose removal cuts a piece of the surface in two, as a
ring around an arm does; each becomes a node. Pieces that do not touch are bridged first, thick
meshes are reduced, and the result is pruned of spurs, merged at crowded forks, smoothed and evenly
resampled, so that every limb is one chain of bones of similar length.

Source: Bærentzen and Rotenberg 2021, "Skeletonization via Local Separators", ACM TOG 40(5), as
implemented by PyGEL3D; the tree that is made of its graph is our own.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

VERSION = 1
"""Changes whenever the same surface would give another skeleton; part of the key of a cache."""

GRAPH_VERTICES = 2000
MOST_PIECES = 64
MOST_NODES = 200
BONES = 60
SPUR = 1.2
CROWDED = 0.75
CHAIN_BONES = (3, 12)
STRAIGHT_BONES = 4

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Chain = list[int]


@dataclass(frozen=True, slots=True)
class _Graph:
    """An undirected graph in space: positions (n, 3), edges (e, 2), local thickness (n,)."""

    positions: FloatArray
    edges: IntArray
    radii: FloatArray

    def neighbours(self) -> list[list[int]]:
        lists: list[list[int]] = [[] for _ in self.positions]
        for a, b in self.edges.tolist():
            lists[a].append(b)
            lists[b].append(a)
        return lists


def extract_skeleton(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, FloatArray]:
    """A tree of nodes inside the surface: parents (K,), -1 for the root, and positions (K, 3).

    Works for closed, open, flat, broken and non-manifold surfaces and for several components; the
    same arrays always give the same tree, of 2 to `MOST_NODES` nodes. The root is the node nearest
    to the centre of the surface; every parent comes before its children.

    Args:
        vertices: (N, 3), any unit and frame; vertices that no face uses do not count.
        faces: (F, 3) into `vertices`.

    Raises:
        ValueError: there is no face, or a vertex that is used is not finite.
        ImportError: PyGEL3D or fast_simplification is not installed.

    Source: Bærentzen and Rotenberg 2021, sections 3 and 4.
    """
    used, compact = np.unique(faces, return_inverse=True)
    points = np.asarray(vertices, dtype=np.float64)[used]
    triangles = compact.reshape(-1, 3)
    if len(triangles) == 0 or not np.isfinite(points).all():
        raise ValueError("Expected `faces` not to be empty and `vertices` to be finite")
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    size = float(np.ptp(points, axis=0).max()) or 1.0
    points = (points - middle) / size
    triangles = _without_slivers(points, triangles)
    centre = _area_centroid(points, triangles)
    reduced_points, reduced = _reduced(points, triangles)
    tree = _tree_of(_surface_graph(reduced_points, reduced), reduced_points)
    if tree is None:
        tree = _principal_axis(points)
    parents, positions = _rooted(tree, centre)
    return parents, positions * size + middle


def _without_slivers(points: FloatArray, triangles: IntArray) -> IntArray:
    a, b, c = triangles.T
    proper = triangles[(a != b) & (b != c) & (c != a)]
    return proper if len(proper) else triangles


def _area_centroid(points: FloatArray, triangles: IntArray) -> FloatArray:
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    if areas.sum() < 1e-12:
        centre: FloatArray = points.mean(axis=0)
        return centre
    return np.asarray(np.average(corners.mean(axis=1), axis=0, weights=areas))


def _reduced(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The surface with about `GRAPH_VERTICES` vertices: separators cost more than linear time."""
    if len(points) <= GRAPH_VERTICES * 1.2:
        return points, triangles
    import fast_simplification  # noqa: PLC0415  (an optional extra)

    fewer_points, fewer = fast_simplification.simplify(
        np.ascontiguousarray(points, dtype=np.float32),
        np.ascontiguousarray(triangles, dtype=np.int32),
        target_count=2 * GRAPH_VERTICES,
    )
    used, compact = np.unique(fewer, return_inverse=True)
    return fewer_points[used].astype(np.float64), compact.reshape(-1, 3).astype(np.int64)


def _surface_graph(points: FloatArray, triangles: IntArray) -> _Graph:
    """The surface's edges; pieces that touch or lie in one another are tied together."""
    edges = _unique_edges(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]],
                                     triangles[:, [2, 0]]]))
    labels = _labels(len(points), edges)
    kept = _significant(points, labels)
    if len(kept) < len(points):
        renumber = np.full(len(points), -1)
        renumber[kept] = np.arange(len(kept))
        edges = renumber[edges]
        edges, points, labels = edges[(edges >= 0).all(axis=1)], points[kept], labels[kept]
    if labels.max() != labels.min():
        lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        pairs = cKDTree(points).query_pairs(float(np.median(lengths)), output_type="ndarray")
        pairs = pairs[labels[pairs[:, 0]] != labels[pairs[:, 1]]]
        edges = _unique_edges(np.vstack([edges, pairs]))
        edges = np.vstack([edges, _bridges(points, _labels(len(points), edges))])
    return _Graph(points, edges, np.zeros(len(points)))


def _unique_edges(pairs: IntArray) -> IntArray:
    return np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0).astype(np.int64)


def _labels(count: int, edges: IntArray) -> IntArray:
    ones = np.ones(len(edges))
    links = coo_array((ones, (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _significant(points: FloatArray, labels: IntArray) -> IntArray:
    """Vertices of the pieces that carry the shape: not of eyes, buttons and stray triangles."""
    count = int(labels.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, labels, points)
    np.maximum.at(high, labels, points)
    sizes = np.linalg.norm(high - low, axis=1)
    ranked = np.argsort(-sizes, kind="stable")[:MOST_PIECES]
    large = ranked[sizes[ranked] >= 0.05 * np.linalg.norm(np.ptp(points, axis=0))]
    return np.flatnonzero(np.isin(labels, large if len(large) else ranked[:1]))


def _bridges(points: FloatArray, labels: IntArray) -> IntArray:
    """Edges that join all pieces into one by the shortest gaps, as a minimum spanning tree."""
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


def _tree_of(surface: _Graph, points: FloatArray) -> _Graph | None:
    """The clean tree of a surface's graph, or None where there is nothing like a limb in it."""
    positions, edges = _local_separators(surface)
    if len(positions) < 2:
        return None
    tree = _spanning_tree(positions, edges, surface.positions)
    tree = _pruned(tree)
    tree = _forks_merged(tree)
    tree = _pruned(tree)
    tree = _resampled(_smoothed(tree))
    if len(tree.positions) < 2 or np.ptp(tree.positions, axis=0).max() < 0.25 * np.ptp(
        points, axis=0
    ).max():
        return None
    return tree


def _local_separators(surface: _Graph) -> tuple[FloatArray, IntArray]:
    """Nodes and edges that PyGEL3D finds, from every vertex: its sampling draws from the system's
    random device and gives another skeleton at each call."""
    try:
        from pygel3d import graph  # noqa: PLC0415  (an optional extra)
    except ImportError as error:
        raise ImportError("curve skeletons need: pip install 'bunraku[characters]'") from error
    network = graph.Graph()
    for point in surface.positions:
        network.add_node(point)
    for a, b in surface.edges.tolist():
        network.connect_nodes(a, b)
    with _quiet_stdout():
        skeleton = graph.LS_skeleton(network, sampling=False)
    skeleton.cleanup()
    nodes = list(skeleton.nodes())
    if not nodes:
        return np.empty((0, 3)), np.empty((0, 2), dtype=np.int64)
    edges = [(a, b) for a in nodes for b in skeleton.neighbors(a) if a < b]
    positions = np.array(skeleton.positions(), dtype=np.float64)
    return positions, np.array(sorted(edges), dtype=np.int64).reshape(-1, 2)


@contextmanager
def _quiet_stdout() -> Iterator[None]:
    """Send what C++ prints to descriptor 1 nowhere: PyGEL3D reports its progress there."""
    try:
        kept = os.dup(1)
    except OSError:  # a service without standard output: nothing to keep quiet
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        with suppress(OSError, AttributeError, TypeError):
            ctypes.CDLL(None).fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def _spanning_tree(positions: FloatArray, edges: IntArray, surface: FloatArray) -> _Graph:
    """One tree over all nodes; a loop around a hole is opened at its longest edge."""
    edges = np.vstack([edges, _bridges(positions, _labels(len(positions), edges))])
    lengths = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1) + 1e-9
    count = len(positions)
    links = coo_array((lengths, (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    tree = minimum_spanning_tree(links).tocoo()
    kept = np.stack([tree.row, tree.col], axis=1).astype(np.int64)
    return _Graph(positions, kept, _thickness(positions, surface))


def _thickness(positions: FloatArray, surface: FloatArray) -> FloatArray:
    """Mean distance (n,) from each node to the surface vertices nearest to it of all nodes."""
    distance, nearest = cKDTree(positions).query(surface)
    owned = np.bincount(nearest, minlength=len(positions))
    total = np.bincount(nearest, weights=distance, minlength=len(positions))
    alone = cKDTree(surface).query(positions)[0]
    return np.where(owned > 0, total / np.maximum(owned, 1), alone)


def _chains(neighbours: list[list[int]]) -> list[Chain]:
    """Maximal runs of nodes between forks and tips, each once; both ends are in the run."""
    ends = [node for node, near in enumerate(neighbours) if len(near) != 2]
    chains = []
    for start in ends:
        for first in neighbours[start]:
            chain = [start, first]
            while len(neighbours[chain[-1]]) == 2:
                a, b = neighbours[chain[-1]]
                chain.append(b if a == chain[-2] else a)
            if chain[0] < chain[-1]:
                chains.append(chain)
    return chains


def _length(positions: FloatArray, chain: Chain) -> float:
    return float(np.linalg.norm(np.diff(positions[chain], axis=0), axis=1).sum())


def _pruned(tree: _Graph) -> _Graph:
    """Without spurs: tips that hardly leave the thickness of the fork they grow from."""
    while True:
        neighbours = tree.neighbours()
        spurs = []
        for chain in _chains(neighbours):
            tips = [len(neighbours[chain[0]]) == 1, len(neighbours[chain[-1]]) == 1]
            if tips[0] == tips[1]:
                continue
            run = chain if tips[1] else chain[::-1]
            length = _length(tree.positions, run)
            if length < max(SPUR * tree.radii[run[0]], 0.03):
                spurs.append((length, run))
        if not spurs:
            return tree
        tree = _without(tree, min(spurs)[1][1:])


def _without(tree: _Graph, nodes: list[int]) -> _Graph:
    keep = np.ones(len(tree.positions), dtype=bool)
    keep[nodes] = False
    renumber = np.cumsum(keep) - 1
    edges = renumber[tree.edges[keep[tree.edges].all(axis=1)]]
    return _Graph(tree.positions[keep], edges, tree.radii[keep])


def _forks_merged(tree: _Graph) -> _Graph:
    """With forks that lie within one another's thickness made into one, as where arms meet."""
    while True:
        neighbours = tree.neighbours()
        crowded = []
        for chain in _chains(neighbours):
            if min(len(neighbours[chain[0]]), len(neighbours[chain[-1]])) > 2:
                length = _length(tree.positions, chain)
                if length < CROWDED * min(tree.radii[chain[0]], tree.radii[chain[-1]]):
                    crowded.append((length, chain))
        if not crowded:
            return tree
        tree = _contracted(tree, min(crowded)[1])


def _contracted(tree: _Graph, chain: Chain) -> _Graph:
    positions, radii = tree.positions.copy(), tree.radii.copy()
    positions[chain[0]] = tree.positions[[chain[0], chain[-1]]].mean(axis=0)
    radii[chain[0]] = tree.radii[[chain[0], chain[-1]]].max()
    renumber = np.arange(len(positions))
    renumber[chain] = chain[0]
    merged = _Graph(positions, _unique_edges(renumber[tree.edges]), radii)
    return _without(merged, chain[1:])


def _smoothed(tree: _Graph) -> _Graph:
    """With the zigzag of single separators taken out of chains; forks and tips stay."""
    neighbours = tree.neighbours()
    positions = tree.positions.copy()
    inner = [node for node, near in enumerate(neighbours) if len(near) == 2]
    if not inner:
        return tree
    near = np.array([neighbours[node] for node in inner])
    for _ in range(3):
        positions[inner] = (positions[inner] + positions[near].mean(axis=1)) / 2
    return _Graph(positions, tree.edges, tree.radii)


def _resampled(tree: _Graph) -> _Graph:
    """With bones of similar length: 3 to 12 from a fork to a tip, 1 to 12 between two forks."""
    neighbours = tree.neighbours()
    chains = _chains(neighbours)
    forks = [node for node, near in enumerate(neighbours) if len(near) != 2]
    renumber = {node: index for index, node in enumerate(forks)}
    positions = list(tree.positions[forks])
    total = sum(_length(tree.positions, chain) for chain in chains)
    room = max(1, (MOST_NODES - len(forks)) // max(1, len(chains)))
    edges = []
    for chain in chains:
        inner = min(len(neighbours[chain[0]]), len(neighbours[chain[-1]])) > 2
        least = 1 if inner else CHAIN_BONES[0]
        wanted = round(BONES * _length(tree.positions, chain) / max(total, 1e-12))
        bones = int(min(max(wanted, least), CHAIN_BONES[1], room))
        last = renumber[chain[0]]
        for point in _evenly(tree.positions[chain], bones)[1:-1]:
            edges.append((last, len(positions)))
            last = len(positions)
            positions.append(point)
        edges.append((last, renumber[chain[-1]]))
    return _Graph(np.array(positions), np.array(edges, dtype=np.int64), np.zeros(len(positions)))


def _evenly(polyline: FloatArray, bones: int) -> FloatArray:
    steps = np.linalg.norm(np.diff(polyline, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, along[-1], bones + 1)
    return np.stack([np.interp(at, along, axis) for axis in polyline.T], axis=1)


def _principal_axis(points: FloatArray) -> _Graph:
    """A straight chain along the longest axis of a lump that has no limbs."""
    centred = points - points.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    along = centred @ axis
    at = np.linspace(along.min(), along.max(), STRAIGHT_BONES + 1)
    positions = points.mean(axis=0) + at[:, None] * axis
    edges = np.stack([np.arange(STRAIGHT_BONES), np.arange(1, STRAIGHT_BONES + 1)], axis=1)
    return _Graph(positions, edges.astype(np.int64), np.zeros(len(positions)))


def _rooted(tree: _Graph, centre: FloatArray) -> tuple[IntArray, FloatArray]:
    root = int(np.argmin(np.linalg.norm(tree.positions - centre, axis=1)))
    count = len(tree.positions)
    ones = np.ones(len(tree.edges))
    links = coo_array((ones, (tree.edges[:, 0], tree.edges[:, 1])), shape=(count, count)).tocsr()
    order, before = breadth_first_order(links, root, directed=False)
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    parents = np.where(order == root, -1, place[np.maximum(before[order], 0)])
    return parents.astype(np.int64), tree.positions[order]
