"""A clean tree from a curve graph: without loops and spurs, smoothed, and with even bones.

Lengths are shares of the longest side of the surface's box. A radius is that of the largest ball
around a node that stays inside the surface.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import cKDTree

from solvers.skeleton.space_graph import (
    FloatArray,
    IntArray,
    SpaceGraph,
    bridges,
    component_labels,
    edge_matrix,
    unique_edges,
)

MOST_NODES = 200

_SPUR = 1.8  # the least length of a limb to its tip, in its largest radii
_PROBES = 8  # bones along which that radius is measured
_CONE = 0.5  # cosine of the half angle ahead of a leaf in which its tip lies
_TIP = 0.9  # the share of the surface around a leaf that lies before its tip
_STUB = 3.0  # ends of an opened loop up to so many radii of their fork are cut back
_CROWDED = 1.0  # forks nearer than so many radii are merged
_BONES = 60
_LIMB_BONES = (3, 12)

Chain = list[int]


def without_loops(positions: FloatArray, edges: IntArray, outside: cKDTree) -> SpaceGraph:
    """Return one tree over all nodes, with every loop opened at its longest edge.

    An opened loop around a real hole leaves two limbs. A small loop comes from separators inside a
    thick part; the ends that it leaves are cut back to their forks.
    """
    edges = np.vstack([edges, bridges(positions, component_labels(len(positions), edges))])
    lengths = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1) + 1e-9
    spanning = minimum_spanning_tree(edge_matrix(len(positions), edges, lengths)).tocoo()
    kept = np.stack([spanning.row, spanning.col], axis=1).astype(np.int64)
    tree = SpaceGraph(positions, kept)
    neighbours = tree.neighbours()
    radii = outside.query(positions)[0]
    cut = set(map(tuple, np.sort(edges).tolist())) - set(map(tuple, np.sort(kept).tolist()))
    ends = {node for edge in cut for node in edge}
    stubs: set[int] = set()
    for run in _tip_chains(neighbours):
        if run[-1] in ends and _length(positions, run) < _STUB * radii[run[0]]:
            stubs.update(run[1:])
    return _without(tree, sorted(stubs))


def with_tips(tree: SpaceGraph, surface: SpaceGraph) -> SpaceGraph:
    """Move every leaf to the tip of its limb on the surface around it."""
    neighbours = tree.neighbours()
    owner = cKDTree(tree.positions).query(surface.positions)[1]
    own = owner[surface.edges[:, 0]] == owner[surface.edges[:, 1]]
    patch = component_labels(len(owner), surface.edges[own])
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
    return SpaceGraph(positions, tree.edges)


def without_spurs(
    tree: SpaceGraph, surface: SpaceGraph, outside: cKDTree, shortest: float
) -> SpaceGraph:
    """Remove spurs: limbs that, extended to their tips, are hardly longer than thick.

    All spurs of a fork are removed at once, so that a head does not end in its longer ear.
    """
    while True:
        whole = with_tips(tree, surface)
        spurs: set[int] = set()
        for run in _tip_chains(tree.neighbours()):
            radii = outside.query(_evenly(whole.positions[run], _PROBES))[0]
            if _length(whole.positions, run) < max(_SPUR * radii.max(), shortest):
                spurs.update(run[1:])
        if not spurs:
            return tree
        tree = _without(tree, sorted(spurs))


def with_merged_forks(tree: SpaceGraph, outside: cKDTree) -> SpaceGraph:
    """Merge forks that lie within one another's radius, as where two arms meet."""
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


def _contracted(tree: SpaceGraph, chain: Chain) -> SpaceGraph:
    positions = tree.positions.copy()
    positions[chain[0]] = tree.positions[[chain[0], chain[-1]]].mean(axis=0)
    renumber = np.arange(len(positions))
    renumber[chain] = chain[0]
    return _without(SpaceGraph(positions, unique_edges(renumber[tree.edges])), chain[1:])


def smoothed(tree: SpaceGraph) -> SpaceGraph:
    """Smooth the zigzag of single separators in chains; forks and tips stay in place."""
    neighbours = tree.neighbours()
    positions = tree.positions.copy()
    inner = [node for node, near in enumerate(neighbours) if len(near) == 2]
    if not inner:
        return tree
    near = np.array([neighbours[node] for node in inner])
    for _ in range(3):
        positions[inner] = (positions[inner] + positions[near].mean(axis=1)) / 2
    return SpaceGraph(positions, tree.edges)


def resampled(tree: SpaceGraph) -> SpaceGraph:
    """Resample to bones of similar length: 3 to 12 from fork to tip, 1 to 12 between forks."""
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
    return SpaceGraph(np.array(positions), np.array(edges, dtype=np.int64))


def _tip_chains(neighbours: list[list[int]]) -> list[Chain]:
    """The chains from a fork to a tip, in this direction."""
    both = [run for chain in _chains(neighbours) for run in (chain, chain[::-1])]
    return [run for run in both if len(neighbours[run[0]]) > 2 and len(neighbours[run[-1]]) == 1]


def _chains(neighbours: list[list[int]]) -> list[Chain]:
    """All chains of nodes between forks and tips, each once, with both ends."""
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


def _without(tree: SpaceGraph, nodes: list[int]) -> SpaceGraph:
    keep = np.ones(len(tree.positions), dtype=bool)
    keep[nodes] = False
    renumber = np.cumsum(keep) - 1
    edges = renumber[tree.edges[keep[tree.edges].all(axis=1)]]
    return SpaceGraph(tree.positions[keep], edges)


def _length(positions: FloatArray, chain: Chain) -> float:
    return float(np.linalg.norm(np.diff(positions[chain], axis=0), axis=1).sum())


def _evenly(polyline: FloatArray, bones: int) -> FloatArray:
    steps = np.linalg.norm(np.diff(polyline, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, along[-1], bones + 1)
    return np.stack([np.interp(at, along, axis) for axis in polyline.T], axis=1)
