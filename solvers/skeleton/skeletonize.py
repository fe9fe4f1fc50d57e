"""The curve skeleton of any surface: local separators of its edge graph, made into a clean tree.

A local separator is a small set of vertices whose removal cuts a piece of the surface in two, as a
ring around an arm does; each becomes a node. Broken surfaces are closed and dense ones reduced
first; the result is opened at its loops, led on to the tips of the limbs, pruned of spurs, merged
at crowded forks, smoothed and evenly resampled, so that every limb is one chain of similar bones.

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
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from solvers.retarget.abstraction import find_root
from solvers.skeleton.tree import Tree
from solvers.surface.voxel_solid import surface_samples, voxel_solid

VERSION = 4
"""Changes whenever the same surface would give another skeleton; part of the key of a cache."""

MOST_NODES = 200

# Lengths are shares of the longest side of the surface's box, radii those of the largest ball
# around a node that stays inside the surface.
_GRAPH_VERTICES = 1200  # separators cost more than linear time
_MOST_ENDS = 66  # so that every limb gets its bones within MOST_NODES
_MOST_PIECES = 64
_SAME = 1e-5  # vertices closer than this are one
_FEWEST = 24  # with fewer vertices there are no rings around limbs
_FLAT = 1e-3  # a surface thinner than this is a sheet
_OPENINGS = 2  # more, and together longer than _OPEN times the root of the area, and there is
_OPEN = 1.5  # no clear inside
_SPACING = 1 / 64  # of the samples on the border of a sheet
_SPUR = 1.8  # a limb is at least so many times as long as its largest radius, to its tip
_PROBES = 8  # bones along which that radius is looked for
_SHORTEST = 0.04  # and at least this
_CONE = 0.5  # cosine of the angle in which a tip lies ahead of a leaf
_TIP = 0.9  # the share of what surrounds a leaf that lies before its tip
_STUB = 3.0  # a loop whose ends are no more radii of their fork long is no hole
_CROWDED = 1.0  # forks closer than so many radii are one
_BONES = 60
_LIMB_BONES = (3, 12)
_STRAIGHT_BONES = 4

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Chain = list[int]


@dataclass(frozen=True, slots=True)
class _Graph:
    """An undirected graph in space: positions (n, 3) and edges (e, 2)."""

    positions: FloatArray
    edges: IntArray

    def neighbours(self) -> list[list[int]]:
        lists: list[list[int]] = [[] for _ in self.positions]
        for a, b in self.edges.tolist():
            lists[a].append(b)
            lists[b].append(a)
        return lists

    def ends(self) -> list[int]:
        """Nodes at which chains end: forks and tips."""
        return [node for node, near in enumerate(self.neighbours()) if len(near) != 2]


def extract_skeleton(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, FloatArray]:
    """A tree of nodes inside the surface: parents (K,), -1 for the root, and positions (K, 3).

    Works for closed, open, flat, broken and non-manifold surfaces and for several components; the
    same arrays always give the same tree, of 2 to `MOST_NODES` nodes. Every parent comes before
    its children.

    Args:
        vertices: (N, 3), any unit and frame; vertices that no face uses do not count.
        faces: (F, 3) into `vertices`.

    Raises:
        ValueError: there is no face, or a vertex that is used is not finite.
        ImportError: PyGEL3D or fast_simplification is not installed.

    Source: Bærentzen and Rotenberg 2021, sections 3 and 4; the root is AniMesh's, section 4.1.
    """
    used, compact = np.unique(faces, return_inverse=True)
    points = np.asarray(vertices, dtype=np.float64)[used]
    if len(points) == 0 or not np.isfinite(points).all():
        raise ValueError("Expected `faces` not to be empty and `vertices` to be finite")
    scale = float(np.abs(points).max()) or 1.0
    points = points / scale
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    size = float((high - low).max()) or 1.0
    points = (points - middle) / size
    tree = _limbs(*_welded(points, compact.reshape(-1, 3)))
    parents, positions = _rooted(tree or _principal_axis(points))
    return parents, (positions * size + middle) * scale


def _welded(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The surface with one vertex where there were several, without faces that have no area."""
    _, first, group = np.unique(
        np.round(points / _SAME), axis=0, return_index=True, return_inverse=True
    )
    triangles = group.reshape(-1)[triangles]
    a, b, c = triangles.T
    return _unpinched(points[first], triangles[(a != b) & (b != c) & (c != a)])


def _unpinched(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The surface with one vertex a fan of faces: knees that touch in a point are two knees."""
    corners = np.arange(triangles.size).reshape(-1, 3)
    pairs = corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends = triangles.reshape(-1)[pairs]
    pairs = np.take_along_axis(pairs, np.argsort(ends, axis=1), axis=1)
    ends.sort(axis=1)
    order = np.lexsort(ends.T)
    shared = (ends[order][1:] == ends[order][:-1]).all(axis=1)
    links = np.stack([pairs[order][:-1][shared], pairs[order][1:][shared]], axis=-1)
    fans: IntArray = _labels(triangles.size, links.reshape(-1, 2))
    _, first = np.unique(fans, return_index=True)
    return points[triangles.reshape(-1)[first]], fans.reshape(-1, 3)


def _limbs(points: FloatArray, triangles: IntArray) -> _Graph | None:
    """The clean tree of a surface, or None where there is nothing like a limb in it."""
    if len(points) < _FEWEST:
        return None
    border = _borders(triangles)
    flat = np.ptp(points @ _axes(points)[2]) < _FLAT
    if flat and len(border):
        outside = cKDTree(
            surface_samples(points, np.column_stack([border, border[:, 0]]), _SPACING)
        )
    else:
        solid = voxel_solid(points, triangles)
        outside = cKDTree(solid.outermost)
        if not flat and not _has_inside(points, triangles, border):
            points, triangles = solid.closed_surface()
    surface = _surface_graph(*_reduced(points, triangles))
    tree = _opened(*_local_separators(surface), outside)
    tree = _pruned(tree, surface, outside, _SHORTEST)
    tree = _forks_merged(tree, outside)
    shortest = _SHORTEST
    while len((tree := _pruned(tree, surface, outside, shortest)).ends()) > _MOST_ENDS:
        shortest *= 1.5
    if len(tree.positions) < 2:
        return None
    tree = _resampled(_smoothed(_with_tips(tree, surface)))
    longest = np.ptp(tree.positions, axis=0).max()
    return tree if longest >= 0.25 * np.ptp(points, axis=0).max() else None


def _axes(points: FloatArray) -> FloatArray:
    """The principal axes of the points, the longest first, as rows."""
    centred = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(centred.T @ centred)[1].T[::-1])


def _borders(triangles: IntArray) -> IntArray:
    """The edges (b, 2) that do not lie between exactly two faces."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, faces = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(edges[faces != 2], dtype=np.int64)


def _has_inside(points: FloatArray, triangles: IntArray, border: IntArray) -> bool:
    """Whether the surface is one piece but for details, with few or small openings."""
    open_length = np.linalg.norm(points[border[:, 0]] - points[border[:, 1]], axis=1).sum()
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normals, axis=1).sum()
    labels = _labels(len(points), np.vstack([triangles[:, :2], triangles[:, 1:]]))
    pieces = len(np.unique(labels[_significant(points, labels)]))
    openings = len(np.unique(_labels(len(points), border)[border]))
    return pieces == 1 and bool(openings <= _OPENINGS or open_length < _OPEN * np.sqrt(area))


def _reduced(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The surface with about `_GRAPH_VERTICES` vertices."""
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
    return _unpinched(fewer_points[used].astype(np.float64), compact.reshape(-1, 3))


def _surface_graph(points: FloatArray, triangles: IntArray) -> _Graph:
    """The surface's edges; pieces that do not touch are tied together where they come closest."""
    edges = _unique_edges(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
    labels = _labels(len(points), edges)
    kept = _significant(points, labels)
    renumber = np.full(len(points), -1)
    renumber[kept] = np.arange(len(kept))
    edges = renumber[edges]
    edges = edges[(edges >= 0).all(axis=1)]
    return _Graph(points[kept], np.vstack([edges, _bridges(points[kept], labels[kept])]))


def _unique_edges(pairs: IntArray) -> IntArray:
    return np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0).astype(np.int64)


def _labels(count: int, edges: IntArray) -> IntArray:
    links = _matrix(count, edges, np.ones(len(edges)))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _matrix(count: int, edges: IntArray, values: FloatArray) -> csr_array:
    links = coo_array((values, (edges[:, 0], edges[:, 1])), shape=(count, count))
    return csr_array(links)


def _significant(points: FloatArray, labels: IntArray) -> IntArray:
    """Vertices of the pieces that carry the shape: not of eyes, buttons and stray triangles."""
    count = int(labels.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, labels, points)
    np.maximum.at(high, labels, points)
    sizes = np.linalg.norm(high - low, axis=1)
    ranked = np.argsort(-sizes, kind="stable")[:_MOST_PIECES]
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


def _local_separators(surface: _Graph) -> tuple[FloatArray, IntArray]:
    """Nodes and edges that PyGEL3D finds, from every vertex: its sampling draws from the system's
    random device and gives another skeleton at each call."""
    try:
        from pygel3d import graph  # noqa: PLC0415  # an optional extra
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


def _opened(positions: FloatArray, edges: IntArray, outside: cKDTree) -> _Graph:
    """One tree over all nodes; a loop is opened at its longest edge.

    Around a real hole that leaves two limbs. A small loop is one of separators inside a thick
    part, and the ends that are left of it are cut back to where they fork.
    """
    edges = np.vstack([edges, _bridges(positions, _labels(len(positions), edges))])
    lengths = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1) + 1e-9
    spanning = minimum_spanning_tree(_matrix(len(positions), edges, lengths)).tocoo()
    kept = np.stack([spanning.row, spanning.col], axis=1).astype(np.int64)
    tree = _Graph(positions, kept)
    neighbours = tree.neighbours()
    radii = outside.query(positions)[0]
    cut = set(map(tuple, np.sort(edges).tolist())) - set(map(tuple, np.sort(kept).tolist()))
    ends = {node for edge in cut for node in edge}
    stubs: set[int] = set()
    for run in _tip_chains(neighbours):
        if run[-1] in ends and _length(positions, run) < _STUB * radii[run[0]]:
            stubs.update(run[1:])
    return _without(tree, sorted(stubs))


def _with_tips(tree: _Graph, surface: _Graph) -> _Graph:
    """With every leaf led on to the tip of its limb, on the surface around it."""
    neighbours = tree.neighbours()
    owner = cKDTree(tree.positions).query(surface.positions)[1]
    own = owner[surface.edges[:, 0]] == owner[surface.edges[:, 1]]
    patch = _labels(len(owner), surface.edges[own])
    positions = tree.positions.copy()
    for leaf, near in enumerate(neighbours):
        if len(near) != 1 or not (owner == leaf).any():
            continue
        ahead = positions[leaf] - tree.positions[near[0]]
        owned = np.flatnonzero(owner == leaf)
        away = np.linalg.norm(surface.positions[owned] - positions[leaf], axis=1)
        around = surface.positions[patch == patch[owned[np.argmin(away)]]] - positions[leaf]
        reach = around @ (ahead / max(float(np.linalg.norm(ahead)), 1e-12))
        straight = reach >= _CONE * np.linalg.norm(around, axis=1)
        if straight.any():
            tip = reach >= np.quantile(reach[straight], _TIP)
            positions[leaf] += around[straight & tip].mean(axis=0)
    return _Graph(positions, tree.edges)


def _chains(neighbours: list[list[int]]) -> list[Chain]:
    """Maximal runs of nodes between forks and tips, each once; both ends are in the run."""
    chains = []
    for start, around in enumerate(neighbours):
        if len(around) == 2:
            continue
        for first in around:
            chain = [start, first]
            while len(neighbours[chain[-1]]) == 2:
                a, b = neighbours[chain[-1]]
                chain.append(b if a == chain[-2] else a)
            if chain[0] < chain[-1]:
                chains.append(chain)
    return chains


def _length(positions: FloatArray, chain: Chain) -> float:
    return float(np.linalg.norm(np.diff(positions[chain], axis=0), axis=1).sum())


def _pruned(tree: _Graph, surface: _Graph, outside: cKDTree, shortest: float) -> _Graph:
    """Without spurs: limbs that, led on to their tips, are hardly longer than thick.

    All spurs of a fork go at once, so that a head does not end in the longer one of its ears.
    """
    while True:
        whole = _with_tips(tree, surface)
        spurs: set[int] = set()
        for run in _tip_chains(tree.neighbours()):
            radii = outside.query(_evenly(whole.positions[run], _PROBES))[0]
            if _length(whole.positions, run) < max(_SPUR * radii.max(), shortest):
                spurs.update(run[1:])
        if not spurs:
            return tree
        tree = _without(tree, sorted(spurs))


def _tip_chains(neighbours: list[list[int]]) -> list[Chain]:
    """The chains that lead from a fork to a tip, in this direction."""
    both = [run for chain in _chains(neighbours) for run in (chain, chain[::-1])]
    return [run for run in both if len(neighbours[run[0]]) > 2 and len(neighbours[run[-1]]) == 1]


def _without(tree: _Graph, nodes: list[int]) -> _Graph:
    keep = np.ones(len(tree.positions), dtype=bool)
    keep[nodes] = False
    renumber = np.cumsum(keep) - 1
    edges = renumber[tree.edges[keep[tree.edges].all(axis=1)]]
    return _Graph(tree.positions[keep], edges)


def _forks_merged(tree: _Graph, outside: cKDTree) -> _Graph:
    """With forks that lie within one another's thickness made into one, as where arms meet."""
    while True:
        neighbours = tree.neighbours()
        radii = outside.query(tree.positions)[0]
        crowded = []
        for chain in _chains(neighbours):
            if min(len(neighbours[chain[0]]), len(neighbours[chain[-1]])) > 2:
                length = _length(tree.positions, chain)
                if length < _CROWDED * max(radii[chain[0]], radii[chain[-1]]):
                    crowded.append((length, chain))
        if not crowded:
            return tree
        tree = _contracted(tree, min(crowded)[1])


def _contracted(tree: _Graph, chain: Chain) -> _Graph:
    positions = tree.positions.copy()
    positions[chain[0]] = tree.positions[[chain[0], chain[-1]]].mean(axis=0)
    renumber = np.arange(len(positions))
    renumber[chain] = chain[0]
    return _without(_Graph(positions, _unique_edges(renumber[tree.edges])), chain[1:])


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
    return _Graph(positions, tree.edges)


def _resampled(tree: _Graph) -> _Graph:
    """With bones of similar length: 3 to 12 from a fork to a tip, 1 to 12 between two forks."""
    neighbours = tree.neighbours()
    chains = _chains(neighbours)
    forks = tree.ends()
    renumber = {node: index for index, node in enumerate(forks)}
    positions = list(tree.positions[forks])
    total = sum(_length(tree.positions, chain) for chain in chains)
    room = max(1, (MOST_NODES - len(forks)) // max(1, len(chains)))
    edges = []
    for chain in chains:
        inner = min(len(neighbours[chain[0]]), len(neighbours[chain[-1]])) > 2
        least = 1 if inner else _LIMB_BONES[0]
        wanted = round(_BONES * _length(tree.positions, chain) / max(total, 1e-12))
        bones = int(min(max(wanted, least), _LIMB_BONES[1], room))
        last = renumber[chain[0]]
        for point in _evenly(tree.positions[chain], bones)[1:-1]:
            edges.append((last, len(positions)))
            last = len(positions)
            positions.append(point)
        edges.append((last, renumber[chain[-1]]))
    return _Graph(np.array(positions), np.array(edges, dtype=np.int64))


def _evenly(polyline: FloatArray, bones: int) -> FloatArray:
    steps = np.linalg.norm(np.diff(polyline, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, along[-1], bones + 1)
    return np.stack([np.interp(at, along, axis) for axis in polyline.T], axis=1)


def _principal_axis(points: FloatArray) -> _Graph:
    """A straight chain along the longest axis of a lump that has no limbs, within its box."""
    axis = _axes(points)[0]
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    middle = points.mean(axis=0)
    along = (points - middle) @ axis
    box = np.stack([points.min(axis=0), points.max(axis=0)]) - middle
    walls = np.sort(box[:, axis != 0.0] / axis[axis != 0.0], axis=0)
    first, last = max(along.min(), walls[0].max()), min(along.max(), walls[1].min())
    positions = middle + np.linspace(first, last, _STRAIGHT_BONES + 1)[:, None] * axis
    edges = np.stack([np.arange(_STRAIGHT_BONES), np.arange(1, _STRAIGHT_BONES + 1)], axis=1)
    return _Graph(positions, edges.astype(np.int64))


def _rooted(tree: _Graph) -> tuple[IntArray, FloatArray]:
    """Parents and positions from the root of AniMesh's hierarchy, every parent first."""
    parents, positions = _ordered(tree, 0)
    root = find_root(Tree(parents, positions))[0]
    return _ordered(tree, int(np.flatnonzero((tree.positions == positions[root]).all(axis=1))[0]))


def _ordered(tree: _Graph, root: int) -> tuple[IntArray, FloatArray]:
    """Parents and positions of the nodes in the order that a walk from `root` meets them."""
    count = len(tree.positions)
    links = _matrix(count, tree.edges, np.ones(len(tree.edges)))
    order, before = breadth_first_order(links, root, directed=False)
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    parents = np.where(order == root, -1, place[np.maximum(before[order], 0)])
    return parents.astype(np.int64), tree.positions[order]
