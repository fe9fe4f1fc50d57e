"""Pairs the limbs of a skeleton across a mirror plane, and finds its middle line.

Tips are paired first: two tips belong together if the path between them is its own mirror image,
or has halves of the same length where the body is posed. Paths of several tips that leave the
middle line together, such as the fingers of two hands, are one pair of limbs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.mirror_plane import MirrorPlane
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Chain = tuple[int, ...]

# In shares of the surface's size.
_UNLIKE = 0.2  # the greatest cost of a pair
_OFF = 0.01  # the least distance of the tips of a pair from the plane
_ACROSS = 0.04  # the least distance, across the plane, of tips that pair although it lies askew,
_ASKEW = 0.14  # the greatest cost of theirs,
_LONG = 0.3  # and the least length of the path between them
_MIDDLE = 0.05  # the greatest distance of a tip of the middle line from the plane
_FORK = 0.03  # a fork so much farther from the plane than another node may be the middle
_DIGITS = 9  # of these distances, in which nodes in the plane are all alike
_TOGETHER = 0.25  # of a limb: with so much of it in common, two limbs are one

_SAMPLES = 16  # of a path that is compared with its mirror image
_SHORTER = 0.5  # weight of the difference of two lengths
_POSED, _POSE = 0.03, 0.4  # a distance from the mirror image counts fully up to, then by


@dataclass(frozen=True, slots=True, eq=False)
class LimbPair:
    """Two limbs that are each other's mirror image.

    Attributes:
        chains: the limb on the normal's side and the one on the other side, each from the node on
            the middle line that it hangs on to the tip.
        cost: how unlike they are, in shares of the surface's size; 0 for mirror images.
    """

    chains: tuple[Chain, Chain]
    cost: float

    @property
    def root(self) -> int:
        """The node of the middle line at which the first limb begins."""
        return self.chains[0][0]


@dataclass(frozen=True, slots=True, eq=False)
class MirroredTree:
    """A tree that a mirror plane divides.

    Attributes:
        plane: the mirror plane.
        middle: the nodes of the middle line: a tree of its own, empty if there is none.
        ends: the ends of the middle line: tips, and nodes where a last pair leaves it.
        pairs: the pairs of limbs, the longest first.
    """

    plane: MirrorPlane
    middle: frozenset[int]
    ends: tuple[int, ...]
    pairs: tuple[LimbPair, ...]


def mirrored_tree(tree: Tree, plane: MirrorPlane, size: float) -> MirroredTree:
    """Pair the limbs of a tree across a plane.

    Args:
        tree: the nodes, in the unit and frame of the plane.
        plane: the mirror plane of the surface around the tree.
        size: the surface's largest extent.
    """
    away = plane.distance(tree.positions) / size
    pairs, single = _paired_tips(tree, plane, size, away)
    middle = _middle_line(tree, pairs, single, away)
    limbs = _limb_pairs(tree, middle, pairs)
    used = {node for limb in limbs for chain in limb.chains for node in chain[1:]}
    middle -= used
    ends = tuple(
        sorted(node for node in middle if sum(n in middle for n in tree.neighbours[node]) <= 1)
    )
    return MirroredTree(plane, frozenset(middle), ends, tuple(limbs))


def _paired_tips(
    tree: Tree, plane: MirrorPlane, size: float, away: Array
) -> tuple[list[tuple[float, int, int]], list[int]]:
    """Pairs (cost, tip on the normal's side, other tip), and the tips without a partner."""
    tips = [tip for tip in tree.leaves if len(tree) > 1]
    alone = [(2.0 * abs(float(away[tip])) + _OFF, tip, tip) for tip in tips]
    costs = [
        (cost, near, far)
        for near in tips
        for far in tips
        if away[near] - away[far] > 2.0 * _OFF
        and (cost := _unlikeness(tree, plane, size, tree.chain(near, far))) < _UNLIKE
    ]
    opposite = [
        (cost, near, far) for cost, near, far in costs if away[near] > _OFF and away[far] < -_OFF
    ]
    chosen = _cheapest(alone + opposite)
    left = {near for _, near, far in chosen if near == far}
    # Where the plane lies askew, both legs of a pair may end on one side of it, or nearly.
    askew = _cheapest(
        [
            (cost, near, far)
            for cost, near, far in costs
            if cost < _ASKEW
            and near in left
            and far in left
            and away[near] - away[far] > _ACROSS
            and tree.length(tree.chain(near, far)) > _LONG * size
        ]
    )
    pairs = [entry for entry in chosen if entry[1] != entry[2]] + askew
    return pairs, sorted(left - {tip for _, *both in askew for tip in both})


def _cheapest(costs: list[tuple[float, int, int]]) -> list[tuple[float, int, int]]:
    """The cheapest of all pairs, then of those that share no tip with it, and so on."""
    chosen: list[tuple[float, int, int]] = []
    taken: set[int] = set()
    for cost, near, far in sorted(costs):
        if near not in taken and far not in taken:
            taken.update((near, far))
            chosen.append((cost, near, far))
    return chosen


def _unlikeness(tree: Tree, plane: MirrorPlane, size: float, path: Chain) -> float:
    """How far a path is from its mirror image, and how unequal its two sides are in length.

    Two legs in mid-step are far from each other's mirror image, but of the same length.
    """
    points = tree.positions[list(path)]
    samples = evenly(points, _SAMPLES)
    gap = np.linalg.norm(plane.mirrored(samples)[::-1] - samples, axis=1).mean()
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    near = plane.distance((points[1:] + points[:-1]) / 2.0) > 0.0
    unequal = abs(float(lengths[near].sum()) - float(lengths[~near].sum()))
    gap, unequal = float(gap) / size, unequal / size
    return min(gap, _POSED + _POSE * (gap - _POSED)) + _SHORTER * unequal


def evenly(points: Array, count: int) -> Array:
    """Return `count` points (count, 3), evenly along a polyline through points (n, 3)."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, points[:, axis]) for axis in range(3)], axis=1)


def _middle_line(
    tree: Tree, pairs: list[tuple[float, int, int]], single: list[int], away: Array
) -> set[int]:
    """The nodes that join the middles of all pairs with the tips near the plane."""
    marks = []
    for _, near, far in pairs:
        path = tree.chain(near, far)[1:-1]
        if path:
            marks.append(_middle_of(tree, path, away))
    inside = {node for _, near, far in pairs for node in tree.chain(near, far)}
    for tip in single:
        if abs(away[tip]) < _MIDDLE or not pairs:
            marks.append(tip)
        elif marks:  # a bent tail hangs on the middle line, a single finger on a limb
            path = tree.chain(tip, marks[0])
            first = next((node for node in path if node in inside), path[-1])
            if first in marks:
                marks.append(tip)
    return {node for mark in marks for node in tree.chain(marks[0], mark)}


def _middle_of(tree: Tree, path: Chain, away: Array) -> int:
    """The node at which a path between two tips crosses the middle line.

    It is near the plane, and a fork if it can be. Of several as good, as where the bones of a rig
    lie in the plane, it is the one that halves the path.
    """
    points = tree.positions[list(path)]
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    off = np.abs(along - along[-1] / 2.0)
    fork = tree.degree[list(path)] > 2
    cost = np.round(np.abs(away[list(path)]) - _FORK * fork, _DIGITS)
    return path[int(np.lexsort((off, cost))[0])]


def _limb_pairs(
    tree: Tree, middle: set[int], pairs: list[tuple[float, int, int]]
) -> list[LimbPair]:
    """Pairs of limbs: of the pairs of tips that leave the middle line together, the longest."""
    groups: list[LimbPair] = []
    for cost, near, far in sorted(pairs):
        path = tree.chain(near, far)
        on_line = [index for index, node in enumerate(path) if node in middle]
        if not on_line:
            continue
        limb = LimbPair((tuple(reversed(path[: on_line[0] + 1])), path[on_line[-1] :]), cost)
        if min(map(len, limb.chains)) < 2:
            continue
        group = _group_of(tree, groups, limb)
        if group is None:
            groups.append(limb)
        elif _length(tree, limb) > _length(tree, groups[group]):
            groups[group] = limb
    return sorted(groups, key=lambda limb: -_length(tree, limb))


def _group_of(tree: Tree, groups: list[LimbPair], limb: LimbPair) -> int | None:
    """The number of the pair that leaves the middle line together with this one, on one side."""
    for group, known in enumerate(groups):
        for one, other in zip(known.chains, limb.chains, strict=True):
            shared = [a for a, b in zip(one, other, strict=False) if a == b]
            least = _TOGETHER * min(tree.length(one), tree.length(other))
            if len(shared) > 1 and tree.length(tuple(shared)) > least:
                return group
    return None


def _length(tree: Tree, limb: LimbPair) -> float:
    return sum(tree.length(chain) for chain in limb.chains)
