"""Joins a limb to the trunk if extraction attached it to the tip of the opposite limb.

Feet that touch can make one leg of an extracted skeleton begin at the other one's sole: up to
its hip, where it ends in the air.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.mirror_plane import MirrorPlane
from solvers.skeleton.tree import Tree

Chain = tuple[int, ...]

# In shares of the surface's size.
_NEAR = 0.12  # the greatest distance of the loose end from the mirror image of its partner's root
_MIDDLE = 0.02  # the greatest distance of a root in the middle from the plane
_LIKE = 0.05  # the greatest mean distance of the limb from its partner's mirror image
_LEAST = 0.25  # the least length of both limbs together
_WIDE = 0.4  # of the reach of one side to that of the other
_NEARER = 0.5  # of the loose end's distance from the plane: the trunk is nearer


def rejoined(tree: Tree, plane: MirrorPlane, size: float) -> NDArray[np.int64] | None:
    """Return parents (K,) of the tree with such a limb joined to the trunk; None without one.

    Args:
        tree: the nodes, in the unit and frame of the plane.
        plane: the mirror plane of the surface around the tree.
        size: the surface's largest extent.
    """
    away = plane.distance(tree.positions) / size
    images = plane.mirrored(tree.positions)
    best: tuple[float, Chain] | None = None
    for loose in tree.leaves:
        gaps = np.linalg.norm(tree.positions - images[loose], axis=1) / size
        for root in np.flatnonzero(gaps < _NEAR).tolist():
            path = tree.chain(loose, root)
            across = away[root] * away[loose] < 0.0 or abs(away[root]) < _MIDDLE
            if tree.degree[root] < 2 or not across or not _has_two_sides(away[list(path)]):
                continue
            if tree.length(path) < _LEAST * size or not _carries_all(tree, path):
                continue
            unlike = _unlikeness(tree, images, path) / size
            if unlike < _LIKE and (best is None or unlike < best[0]):
                best = unlike, path
    return None if best is None else _hung(tree, best[1], away)


def _has_two_sides(away: NDArray[np.float64]) -> bool:
    """Whether a path leads as far from the plane on either side of it."""
    reach = sorted((float(away.max()), float(-away.min())))
    return reach[0] > _WIDE * reach[1]


def _carries_all(tree: Tree, path: Chain) -> bool:
    """Whether more bones lie beyond the last node of a path than on it and beside it."""
    beyond = tree.subtree(path[-1], path[-2])[1:]
    rest = set(range(len(tree))) - set(beyond)
    lengths = tree.bone_lengths
    return bool(lengths[list(beyond)].sum() > lengths[list(rest)].sum())


def _unlikeness(tree: Tree, images: NDArray[np.float64], path: Chain) -> float:
    """Mean distance of the path's nodes from the mirror image of the path [unit of the tree]."""
    places, other = tree.positions[list(path)], images[list(path)]
    starts, bones = other[:-1], np.diff(other, axis=0)
    offsets = places[:, None] - starts
    squares = np.maximum((bones**2).sum(axis=1), 1e-30)
    share = np.clip((offsets * bones).sum(axis=2) / squares, 0.0, 1.0)
    gaps = np.linalg.norm(offsets - share[..., None] * bones, axis=2)
    return float(gaps.min(axis=1).mean())


def _hung(tree: Tree, path: Chain, away: NDArray[np.float64]) -> NDArray[np.int64]:
    """Parents after the bone of a path that crosses the plane is taken to the path's other end."""
    loose, root = path[0], path[-1]
    crossing = next(
        place for place in range(len(path) - 1) if away[path[place + 1]] * away[loose] <= 0.0
    )
    trunk = tree.rerooted(root)
    beyond = [root, *tree.subtree(root, path[-2])[1:]]
    middle = next((node for node in beyond if abs(away[node]) <= _NEARER * abs(away[loose])), root)
    parents = trunk.parents.copy()
    limb, partner = path[: crossing + 1], path[crossing + 1]
    for node in tree.neighbours[limb[-1]]:  # the partner's own toes stay with it
        if node not in path and away[node] * away[loose] < 0.0:
            parents[node] = partner
    parents[list(limb[1:])] = limb[:-1]
    parents[loose] = middle
    return np.asarray(Tree(parents, tree.positions).rerooted(tree.root).parents)
