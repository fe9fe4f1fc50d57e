"""Level-of-detail hierarchy of a skeleton: the sub-trees that a performer may be matched to.

Source: AniMesh (Jin et al. 2015), section 4.1.

Leaf chains collapse to one node each (steps 1 and 2), branch nodes with at most one neighbour that
is not such a leaf root a sub-tree (step 3), each sub-tree becomes a leaf in turn (step 4), until a
single node or a chain is left, which gives the root of all. Seen from that root every abstracted
node depends on what hangs below it alone, so the positions and lengths of all levels come from one
pass up the tree; the rounds only say which sub-tree belongs to which level.

Beyond the paper: a sub-tree is also offered *unfolded* (the word of section 5.2), with the limbs of
its larger inner sub-trees as branches of their own, so that a whole body can meet a whole body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

# A fork is part of the body plan if what hangs on it reaches this share of the whole: a chest or a
# pelvis is, a wrist with its fingers or a face is not.
BODY_PLAN: Final = 0.25
# A side chain shorter than this share of the whole is a spur of the extraction or a twist joint.
SPUR: Final = 0.1
# Of a performer; two hands have ten. The longest are kept.
MOST_LIMBS: Final = 20
# Where the second limb of a fork is shorter than this share of the first, the first goes on through
# it: a wing past its feathers, an arm past a twist joint.
_SIDE: Final = 0.4
# Unfolding opens inner sub-trees from the largest down to this share of the whole, those together
# that are as large as one another up to this factor: both hands, not first one and then the other.
_SMALLEST: Final = 0.08
_ALIKE: Final = 0.97


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """One branch of a sub-tree.

    Attributes:
        fork: the branch node that it belongs to.
        chain: node ids from there (a short side chain: from the limb that it hangs on) to its leaf
            or to the root of the sub-tree that was abstracted into its leaf (q of figure 5).
        extension: node ids that lead on from there along the longest chain to a leaf; () at a leaf.
        position: abstracted position of the branch's end (step 2 and 4), shape (3,) for a tree; for
            other per-node values, that weighted mean of theirs.
        length: accumulated length of all chains in the branch.
    """

    fork: int
    chain: tuple[int, ...]
    extension: tuple[int, ...]
    position: Array
    length: float


@dataclass(frozen=True, slots=True, eq=False)
class SubTree:
    """A part of a skeleton as one candidate for matching.

    Attributes:
        root: the node that it hangs on.
        centre: the node that its branches are seen from: the root; unfolded, that node between the
            opened forks which is nearest to the branches' centre of mass.
        level: round of section 4.1 in which it was found, from 1 (small parts) up.
        branches: what hangs on it.
        stem: node ids from the next fork towards the whole's root down to `root`; () at the top.
        unfolding: 0 as the paper folds it, then 1, 2, ... the more inner sub-trees are opened.
        coarser: how many branches the unfolding before this one has; 0 if this is the first.
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
    """All sub-trees of a skeleton over all levels, and the root they led to."""

    tree: Tree
    root: int
    subtrees: tuple[SubTree, ...]


def abstract(tree: Tree, root: int | None = None) -> Hierarchy:
    """Level-of-detail hierarchy of `tree`; its root is found unless given.

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
    """Root of the hierarchy, and for each branch node the round in which it roots a sub-tree.

    Source: AniMesh, section 4.1: the node that remains, or on a remaining chain the node nearest
    to the centre of mass.
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
    return _nearest(tree, chain, tree.centroid), levels


def _nearest(tree: Tree, nodes: Sequence[int], point: Array) -> int:
    """That one of `nodes` which lies nearest to `point`."""
    distances = np.linalg.norm(tree.positions[list(nodes)] - point, axis=1)
    return nodes[int(np.argmin(distances))]


def _centre(tree: Tree, forks: Sequence[int], ends: Array, branches: Sequence[Branch]) -> int:
    """The node between `forks` nearest to the centre of mass of branches with abstracted `ends`."""
    inner = sorted({node for fork in forks for node in tree.chain(forks[0], fork)})
    if not branches:
        return forks[0]
    return _nearest(tree, inner, _weighted_mean(ends, np.array([b.length for b in branches])))


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
    """The child of the root `fork` that leads to the other end of the chain that remained.

    Both ends of the last chain root a sub-tree in the same round; where the global root falls on
    one of them, the way to the other is not part of that end's own sub-tree.
    """
    if fork != oriented.root:
        return None
    peers = [other for other, level in levels.items() if level == levels[fork] and other != fork]
    for other in peers:
        chain = oriented.chain(fork, other)
        if not any(node in levels for node in chain[1:-1]):
            return chain[1]
    return None


class Folding:
    """Abstracted positions and accumulated lengths of all that hangs on each node of a rooted tree.

    `values` (K, d) are averaged as positions are; the identity gives the averaging weights.
    """

    def __init__(self, tree: Tree, values: Array) -> None:
        self.tree = tree
        self.reach: Array = tree.bone_lengths + tree.heights  # from a node's parent to a leaf
        self._own = values
        self._ends = values.copy()  # of what is folded into a node
        self._lengths = np.zeros(len(tree))
        for node in reversed(tree.order):
            if len(tree.children[node]) > 1:
                folded = [self._collapse(self.walk(node, child)) for child in tree.children[node]]
                lengths = np.array([length for _, length in folded])
                self._ends[node] = _weighted_mean(np.array([end for end, _ in folded]), lengths)
                self._lengths[node] = lengths.sum()

    def branch(self, fork: int, chain: tuple[int, ...]) -> Branch:
        """The branch of `fork` along `chain`, with all that hangs on its end folded into that."""
        position, length = self._collapse(chain)
        return Branch(fork, chain, self._longest(chain[-1]), position, length)

    def walk(self, fork: int, child: int) -> tuple[int, ...]:
        """Nodes from `fork` over `child` to the next leaf or branch node (step 1)."""
        chain = [fork, child]
        while len(ahead := self.tree.children[chain[-1]]) == 1:
            chain.append(ahead[0])
        return tuple(chain)

    def walk_limb(self, fork: int, child: int, shortest: float) -> tuple[int, ...]:
        """Nodes from `fork` over `child` to where the limb ends or splits, past side chains."""
        chain = [fork, child]
        while ahead := self.tree.children[chain[-1]]:
            if len(ahead) > 1:
                ahead = self.limbs(chain[-1], shortest)
            reach = sorted((self.reach[limb] for limb in ahead), reverse=True)
            if not reach or (len(reach) > 1 and reach[1] >= _SIDE * reach[0]):
                break
            chain.append(max(ahead, key=lambda limb: self.reach[limb]))
        return tuple(chain)

    def limbs(self, node: int, shortest: float) -> tuple[int, ...]:
        """The children of `node` over which a leaf at least `shortest` away is reached."""
        return tuple(child for child in self.tree.children[node] if self.reach[child] >= shortest)

    def _collapse(self, chain: tuple[int, ...]) -> tuple[Array, float]:
        """Position and accumulated length of a chain as one node (steps 1, 2 and 4).

        An inner node weighs what its outgoing bone is long, a sub-tree folded into the end what
        was accumulated in it; a leaf has neither and counts only where nothing else does.
        """
        end, bones = chain[-1], self.tree.bone_lengths[list(chain[1:])]
        points = np.concatenate([self._own[list(chain[1:-1])], self._ends[[end]]])
        weights = np.append(bones[1:], self._lengths[end])
        position = _weighted_mean(points, weights) if weights.any() else self._ends[end]
        return position, float(bones.sum() + self._lengths[end])

    def _longest(self, node: int) -> tuple[int, ...]:
        path: list[int] = []
        while below := self.tree.children[node]:
            node = max(below, key=lambda child: (self.reach[child], -child))
            path.append(node)
        return tuple(path)


def fold(folding: Folding, top: int, excluded: int | None = None) -> tuple[Branch, ...]:
    """The branches of the sub-tree at `top`, without the child `excluded` (step 3)."""
    children = (child for child in folding.tree.children[top] if child != excluded)
    return tuple(folding.branch(top, folding.walk(top, child)) for child in children)


@dataclass(frozen=True, slots=True, eq=False)
class Limbs:
    """A sub-tree with its larger inner sub-trees opened.

    Attributes:
        branches: the limbs.
        sides: what hangs on the way, beside a limb or between forks, and is much shorter.
        forks: the nodes that the limbs hang on, the sub-tree's root first.
    """

    branches: tuple[Branch, ...]
    sides: tuple[Branch, ...]
    forks: tuple[int, ...]


def unfold(folding: Folding, top: int, opening: float, excluded: int | None = None) -> Limbs:
    """The limbs of the sub-tree at `top` with inner sub-trees opened.

    Args:
        folding: of a rooted tree.
        top: the root of the sub-tree.
        opening: inner sub-trees are opened that reach at least this share of the whole one.
        excluded: a child of `top` that does not belong to the sub-tree.
    """
    heights = folding.tree.heights
    shortest = SPUR * heights[top]
    branches: list[Branch] = []
    sides: list[Branch] = []
    forks = [top]
    for fork in forks:
        for child in folding.limbs(fork, shortest):
            if fork == top and child == excluded:
                continue
            chain = folding.walk_limb(fork, child, shortest)
            end = chain[-1]
            if heights[end] >= opening * heights[top] and len(folding.limbs(end, shortest)) > 1:
                forks.append(end)
            else:
                branches.append(folding.branch(fork, chain))
            for node, ahead in pairwise(chain[1:]):
                beside = (limb for limb in folding.limbs(node, shortest) if limb != ahead)
                chains = (folding.walk_limb(node, limb, shortest) for limb in beside)
                sides += [folding.branch(fork, side) for side in chains]
    return Limbs(tuple(branches), tuple(sides), tuple(forks))


def _unfoldings(folding: Folding, top: int, level: int, excluded: int | None) -> list[SubTree]:
    """The sub-tree at `top` as the paper folds it, then with its larger inner sub-trees opened."""
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
        centre = _centre(tree, limbs.forks, ends, limbs.branches)
        coarser, plan = len(found[-1].branches), opening >= BODY_PLAN
        found.append(SubTree(top, centre, level, branches, tuple(stem), len(found), coarser, plan))
    return found


def _openings(folding: Folding, top: int, excluded: int | None) -> list[float]:
    """Shares of the whole at which one more group of inner sub-trees opens, descending."""
    heights = folding.tree.heights
    forks = unfold(folding, top, _SMALLEST, excluded).forks
    whole = max(heights[top], 1e-300)
    shares = sorted((float(heights[fork] / whole) for fork in forks[1:]), reverse=True)
    last = [here for here, after in pairwise([*shares, 0.0]) if after < _ALIKE * here]
    return [share * (1.0 - 1e-9) for share in last]  # so that rounding leaves none shut


@dataclass(frozen=True, slots=True, eq=False)
class SimplifiedSource:
    """A performer's skeleton after one step of simplification (figure 3b), ready for every frame.

    Attributes:
        tree: the performer's joints.
        chains: joint ids of each of the m branches, from the fork it hangs on to a leaf.
        weights: (m, J); a branch's abstracted position is its row times the joints' positions.
        forks: joint ids of the branch nodes that were kept, the one nearest to the tree's root
            first.
        centre: the joint that branches are seen from, chosen as in `SubTree`.
        stem: joint ids from the tree's root down to the first fork; () where that is the root.
        length: longest branch at rest, from `centre` to its abstracted position.
    """

    tree: Tree
    chains: tuple[tuple[int, ...], ...]
    weights: Array
    forks: tuple[int, ...]
    centre: int
    stem: tuple[int, ...]
    length: float

    def branch_vectors(self, positions: Array) -> Array:
        """Abstracted branches (m, 3) of a pose (J, 3), seen from the centre."""
        vectors: Array = self.weights @ positions - positions[self.centre]
        return vectors


def simplify(tree: Tree) -> SimplifiedSource:
    """Simplify a performer's skeleton to its limbs: AniMesh, section 4.1 and figure 3b.

    Leaf chains collapse in a single step, as in the paper. Where a skeleton has more than limbs,
    what is small against the whole belongs to the limb that carries it: hands with fingers on a
    body, a face, twist joints. A hand alone keeps its fingers.
    """
    folding = Folding(tree, np.eye(len(tree)))
    shortest = SPUR * tree.heights[tree.root]
    stem: tuple[int, ...] = (tree.root,)
    if len(first := folding.limbs(tree.root, shortest)) == 1:
        stem = folding.walk_limb(tree.root, first[0], shortest)
    top = stem[-1] if len(folding.limbs(stem[-1], shortest)) > 1 else tree.root
    limbs = unfold(folding, top, BODY_PLAN)
    longest = sorted(limbs.branches, key=lambda branch: -branch.length)[:MOST_LIMBS]
    branches = tuple(branch for branch in limbs.branches if branch in longest)
    weights = np.array([branch.position for branch in branches]).reshape(-1, len(tree))
    centre = _centre(tree, limbs.forks, weights @ tree.positions, branches)
    vectors = weights @ tree.positions - tree.positions[centre]
    return SimplifiedSource(
        tree,
        tuple(branch.chain + branch.extension for branch in branches),
        weights,
        limbs.forks,
        centre,
        stem if top != tree.root else (),
        float(np.linalg.norm(vectors, axis=1).max(initial=0.0)),
    )


def _weighted_mean(points: Array, weights: Array) -> Array:
    mean: Array = weights @ points / weights.sum() if weights.any() else points.mean(axis=0)
    return mean
