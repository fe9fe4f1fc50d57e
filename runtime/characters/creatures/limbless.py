"""The plan of a body without limbs: a snake or worm that lies, a fish, a bottle that stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan, Chain
from solvers.skeleton.limbs import closest_bones, surface_points
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_FEWEST = 8  # nodes
_SPUR = 0.15  # of the length: a longer branch, such as a handle or a leg, is a limb
_SPURS = 3  # at most: more are fingers
_LYING = (0.4, 0.8, 0.9)  # shares at hips, chest and skull, from the tail to the snout
_LONG = 10.0  # the least length of a body that lies, in radii
_STANDING = (0.0, 0.6, 0.75)  # the shares of a body that stands, from the floor to its top
_TALL = 5.0  # the least length of one, in radii
_END = 0.15  # of the length: the part that shows whether an end is a head
_MOUTH = 0.25  # what a forked end, a mouth or a tongue, adds to the ratio of the ends' radii
_DOUBT = 0.05


def plan_of_limbless(vertices: Array, faces: NDArray[np.int64], tree: Tree) -> BodyPlan | None:
    """Return the plan of a body that is one line without branches; None for any other.

    A body that lies has its head at the thicker end, or where it has a mouth, and its hips in the
    middle; the rest is its tail. One that stands has its hips on the floor.

    Args:
        vertices: (N, 3) [m] surface at rest, +Y up.
        faces: (F, 3) into `vertices`.
        tree: the skeleton's nodes at rest [m].
    """
    spine = longest_path(tree)
    length = tree.length(spine)
    if len(spine) < _FEWEST or not length > 0.0 or _has_limbs(tree, spine, _SPUR * length):
        return None
    points = surface_points(vertices, faces)
    nearest, radius = closest_bones(points, tree.parents, tree.positions)
    x, y, z = np.abs(tree.positions[spine[-1]] - tree.positions[spine[0]])
    stands = bool(y > np.hypot(x, z))
    if length < (_TALL if stands else _LONG) * float(np.median(radius)):
        return None
    if stands:
        spine = spine if tree.positions[spine[0], 1] < tree.positions[spine[-1], 1] else spine[::-1]
        return _divided(tree, spine, _STANDING)
    if headness(tree, spine, nearest, radius) < 0.0:
        spine = spine[::-1]
    return _divided(tree, spine, _LYING)


def longest_path(tree: Tree) -> Chain:
    """The longest path between two leaves."""
    one = max(tree.leaves, key=lambda leaf: tree.length(tree.chain(tree.root, leaf)))
    other = max(tree.leaves, key=lambda leaf: tree.length(tree.chain(one, leaf)))
    return tree.chain(one, other)


def _has_limbs(tree: Tree, spine: Chain, least: float) -> bool:
    """Whether a branch of the spine is longer than `least` [m], or there are many."""
    if len(tree.leaves) - 2 > _SPURS:
        return True
    for leaf in tree.leaves:
        path = tree.chain(leaf, spine[0])
        own = path[: next(place for place, node in enumerate(path) if node in spine) + 1]
        if tree.length(own) > least:
            return True
    return False


def headness(tree: Tree, spine: Chain, nearest: NDArray[np.int64], radius: Array) -> float:
    """How much more the last end of a spine looks like a head than the first; 0 for a tie."""
    shares = _shares(tree, spine)
    thick, forked = [], []
    for at in (shares, shares[::-1].max() - shares):
        own = [node for node, share in zip(spine, at, strict=True) if share <= _END]
        near = np.isin(nearest, [n for node in own for n in _beside(tree, node, spine)])
        thick.append(float(np.median(radius[near])) if near.any() else 0.0)
        forked.append(any(len(tree.neighbours[node]) > 2 for node in own))
    gap = (thick[1] - thick[0]) / max(*thick, 1e-12) + _MOUTH * (forked[1] - forked[0])
    ahead = tree.positions[spine[-1]] - tree.positions[spine[0]]
    # As most files have it; with a tie broken the same way always.
    return gap if abs(gap) > _DOUBT else float(ahead @ (0.1, 0.0, 1.0))


def _beside(tree: Tree, node: int, spine: Chain) -> Chain:
    """A node of the spine, and the nodes of the spurs on it."""
    spurs = [
        there
        for near in tree.neighbours[node]
        if near not in spine
        for there in tree.subtree(near, node)
    ]
    return (node, *spurs)


def _divided(tree: Tree, spine: Chain, marks: tuple[float, float, float]) -> BodyPlan:
    """The plan of a spine, from its tail to its head, divided at hips, chest and skull."""
    shares = _shares(tree, spine)
    hips, chest, skull = (int(np.argmin(np.abs(shares - mark))) for mark in marks)
    chest = min(max(chest, hips + 1), len(spine) - 2)
    skull = min(max(skull, chest), len(spine) - 2)
    tail = spine[hips::-1]
    return BodyPlan(
        trunk=spine[hips : chest + 1],
        head=spine[chest:],
        skull=spine[skull],
        tail=tail if len(tail) > 1 else (),
    )


def _shares(tree: Tree, spine: Chain) -> Array:
    gaps = np.linalg.norm(np.diff(tree.positions[list(spine)], axis=0), axis=1)
    along = np.append(0.0, np.cumsum(gaps))
    shares: Array = along / along[-1]
    return shares
