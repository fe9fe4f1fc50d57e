"""Level-of-detail hierarchy of a skeleton: the sub-trees that a performer can be matched with.

Source: AniMesh (Jin et al. 2015), section 4.1.

Each leaf chain collapses to one node (steps 1 and 2). A branch node with at most one neighbour that
is not such a leaf is the root of a sub-tree (step 3). Each sub-tree then becomes a leaf itself
(step 4), until a single node or a chain is left, which gives the root of the hierarchy. From that
root, every abstracted node depends only on the nodes below it. So one pass up the tree gives the
positions and lengths of all levels; the rounds only assign sub-trees to levels.

Beyond the paper: each sub-tree also occurs *unfolded* (the word of section 5.2), with the limbs of
its larger inner sub-trees as separate branches, so that a whole body can be matched with a whole
body.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solvers.retarget.folding import (
    BODY_PLAN,
    Branch,
    Folding,
    centre_node,
    fold,
    nearest_node,
    unfold,
)
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

# Unfolding opens inner sub-trees from the largest down to _SMALLEST of the whole. Sub-trees whose
# sizes agree up to the factor _ALIKE open together: both hands, not one hand after the other.
_SMALLEST: Final = 0.08
_ALIKE: Final = 0.97


@dataclass(frozen=True, slots=True, eq=False)
class SubTree:
    """A part of a skeleton as one candidate for matching.

    Attributes:
        root: the node at which it is attached.
        centre: the origin of its branches: the root; unfolded, the node between the opened forks
            that is nearest to the branches' centre of mass.
        level: the round of section 4.1 in which it was found, from 1 (small parts) up.
        branches: its branches.
        stem: node ids from the next fork (towards the hierarchy's root) to `root`; () at the top.
        unfolding: 0 as the paper folds it, then 1, 2, ... with more inner sub-trees opened.
        coarser: the number of branches of the unfolding before this one; 0 for the first.
        body_plan: whether only sub-trees of the body plan (`BODY_PLAN`) are opened.
    """

    root: int
    centre: int
    level: int
    branches: tuple[Branch, ...]
    stem: tuple[int, ...] = ()
    unfolding: int = 0
    coarser: int = 0
    body_plan: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Hierarchy:
    """All sub-trees of a skeleton over all levels, and the root of the hierarchy."""

    tree: Tree
    root: int
    subtrees: tuple[SubTree, ...]


def abstract(tree: Tree, root: int | None = None) -> Hierarchy:
    """Return the level-of-detail hierarchy of `tree`; its root is found unless given.

    Source: AniMesh, section 4.1, steps 1 to 4 and the choice of the global root.
    """
    found, levels = find_root(tree, root)
    oriented = tree.rerooted(found)
    folded = Folding(oriented, oriented.positions)
    subtrees: list[SubTree] = []
    for fork, level in sorted(levels.items(), key=lambda item: (item[1], item[0])):
        subtrees.extend(_unfoldings(folded, fork, level, _last_neighbour(oriented, levels, fork)))
    top = max(levels.values(), default=0) + 1
    if found not in levels or _last_neighbour(oriented, levels, found) is not None:
        subtrees.extend(_unfoldings(folded, found, top, None))
    if not levels and len(tree) > 1:  # a plain chain: also one polyline from either end
        ends = [leaf for leaf in tree.leaves if leaf != found]
        for end in ends:
            from_end = tree.rerooted(end)
            subtrees.extend(_unfoldings(Folding(from_end, tree.positions), end, top, None))
    return Hierarchy(tree, found, tuple(subtrees))


def find_root(tree: Tree, root: int | None = None) -> tuple[int, dict[int, int]]:
    """Return the hierarchy's root, and for each branch node the round of its sub-tree.

    Source: AniMesh, section 4.1: the root is the remaining node, or the node of the remaining chain
    that is nearest to the centre of mass.
    """
    around = _fork_graph(tree, root)
    levels: dict[int, int] = {}
    remaining: tuple[int, ...] = ()
    while around:
        ready = tuple(f for f, others in around.items() if len(others) <= 1 and f != root)
        if not ready:
            ready = tuple(around)
        level = 1 + max(levels.values(), default=0)
        levels |= dict.fromkeys(ready, level)
        remaining = ready
        for fork in ready:
            for other in around.pop(fork):
                if other in around:
                    around[other].discard(fork)
    if root is not None:
        return root, levels
    if len(remaining) == 1:
        return remaining[0], levels
    chain = tree.chain(*remaining) if remaining else tuple(range(len(tree)))
    return nearest_node(tree, chain, tree.centroid), levels


def _fork_graph(tree: Tree, root: int | None) -> dict[int, set[int]]:
    """For each branch node (and the given root) the branch nodes next to it along a chain."""
    forks = {int(node) for node in np.flatnonzero(tree.degree > 2)}
    if root is not None:
        forks.add(root)
    around: dict[int, set[int]] = {fork: set() for fork in sorted(forks)}
    for fork, found in around.items():
        for neighbour in tree.neighbours[fork]:
            before, here = fork, neighbour
            while here not in forks and len(tree.neighbours[here]) == 2:
                one, other = tree.neighbours[here]
                before, here = here, (one if other == before else other)
            if here in forks:
                found.add(here)
    return around


def _last_neighbour(oriented: Tree, levels: dict[int, int], fork: int) -> int | None:
    """The child of the root `fork` that leads to the other end of the remaining chain.

    Both ends of the last chain are roots of sub-trees of the same round. If one of them is the
    global root, the way to the other end is no part of its own sub-tree.
    """
    if fork != oriented.root:
        return None
    peers = [other for other, level in levels.items() if level == levels[fork] and other != fork]
    for other in peers:
        chain = oriented.chain(fork, other)
        if not any(node in levels for node in chain[1:-1]):
            return chain[1]
    return None


def _unfoldings(folding: Folding, top: int, level: int, excluded: int | None) -> list[SubTree]:
    """The sub-tree at `top` as the paper folds it, then with larger inner sub-trees opened."""
    tree = folding.tree
    stem = [top]
    while tree.parents[stem[-1]] >= 0 and (len(stem) == 1 or len(tree.children[stem[-1]]) == 1):
        stem.append(int(tree.parents[stem[-1]]))
    stem = stem[::-1] if len(stem) > 1 else []
    found = [SubTree(top, top, level, fold(folding, top, excluded), tuple(stem))]
    for opening in _openings(folding, top, excluded):
        limbs = unfold(folding, top, opening, excluded)
        branches = limbs.branches + limbs.sides
        if {b.chain for b in branches} <= {b.chain for b in found[-1].branches}:
            continue
        ends = np.array([branch.position for branch in limbs.branches])
        centre = centre_node(tree, limbs.forks, ends, limbs.branches)
        coarser, plan = len(found[-1].branches), opening >= BODY_PLAN
        found.append(SubTree(top, centre, level, branches, tuple(stem), len(found), coarser, plan))
    return found


def _openings(folding: Folding, top: int, excluded: int | None) -> list[float]:
    """The shares of the whole at which another group of inner sub-trees opens, descending."""
    heights = folding.tree.heights
    forks = unfold(folding, top, _SMALLEST, excluded).forks
    whole = max(heights[top], 1e-300)
    shares = sorted((float(heights[fork] / whole) for fork in forks[1:]), reverse=True)
    last = [here for here, after in pairwise([*shares, 0.0]) if after < _ALIKE * here]
    return [share * (1.0 - 1e-9) for share in last]  # so that rounding keeps none closed
