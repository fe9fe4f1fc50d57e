"""The branches of a rooted tree, with the sub-tree at each branch's end folded into one node.

Source: AniMesh (Jin et al. 2015), section 4.1, steps 1, 2 and 4.
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

# A fork belongs to the body plan if its sub-tree reaches this share of the whole: a chest or a
# pelvis does, a wrist with its fingers or a face does not.
BODY_PLAN: Final = 0.25
# A shorter side chain, as a share of the whole, is a spur of the extraction or a twist joint.
SPUR: Final = 0.1
# If the second limb of a fork is shorter than this share of the first, the first limb continues
# through the fork: a wing past its feathers, an arm past a twist joint.
_SIDE: Final = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """One branch of a sub-tree.

    Attributes:
        fork: the branch node to which it belongs.
        chain: node ids from the fork (for a short side chain: from its limb) to the leaf, or to
            the root of the sub-tree that was abstracted into the leaf (q of figure 5).
        extension: node ids from there along the longest chain to a leaf; () at a leaf.
        position: abstracted position of the branch's end (steps 2 and 4), shape (3,) for a tree;
            for other per-node values their weighted mean.
        length: total length of all chains in the branch.
    """

    fork: int
    chain: tuple[int, ...]
    extension: tuple[int, ...]
    position: Array
    length: float


class Folding:
    """Abstracted positions and total lengths of the sub-trees at all nodes of a rooted tree.

    `values` (K, d) are averaged like positions; the identity gives the averaging weights.
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
                self._ends[node] = weighted_mean(np.array([end for end, _ in folded]), lengths)
                self._lengths[node] = lengths.sum()

    def branch(self, fork: int, chain: tuple[int, ...]) -> Branch:
        """Return the branch of `fork` along `chain`, with the sub-tree at its end folded."""
        position, length = self._collapse(chain)
        return Branch(fork, chain, self._longest(chain[-1]), position, length)

    def walk(self, fork: int, child: int) -> tuple[int, ...]:
        """Return the nodes from `fork` over `child` to the next leaf or branch node (step 1)."""
        chain = [fork, child]
        while len(ahead := self.tree.children[chain[-1]]) == 1:
            chain.append(ahead[0])
        return tuple(chain)

    def walk_limb(self, fork: int, child: int, shortest: float) -> tuple[int, ...]:
        """The nodes from `fork` over `child` to the limb's end or split, over side chains."""
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
        """Return the children of `node` that lead to a leaf at least `shortest` away."""
        return tuple(child for child in self.tree.children[node] if self.reach[child] >= shortest)

    def _collapse(self, chain: tuple[int, ...]) -> tuple[Array, float]:
        """Position and accumulated length of a chain as one node (steps 1, 2 and 4).

        The weight of an inner node is the length of its outgoing bone, that of a folded sub-tree
        its total length. A leaf has weight 0 and counts only if all weights are 0.
        """
        end, bones = chain[-1], self.tree.bone_lengths[list(chain[1:])]
        points = np.concatenate([self._own[list(chain[1:-1])], self._ends[[end]]])
        weights = np.append(bones[1:], self._lengths[end])
        position = weighted_mean(points, weights) if weights.any() else self._ends[end]
        return position, float(bones.sum() + self._lengths[end])

    def _longest(self, node: int) -> tuple[int, ...]:
        path: list[int] = []
        while below := self.tree.children[node]:
            node = max(below, key=lambda child: (self.reach[child], -child))
            path.append(node)
        return tuple(path)


def fold(folding: Folding, top: int, excluded: int | None = None) -> tuple[Branch, ...]:
    """Return the branches of the sub-tree at `top`, without the child `excluded` (step 3)."""
    children = (child for child in folding.tree.children[top] if child != excluded)
    return tuple(folding.branch(top, folding.walk(top, child)) for child in children)


@dataclass(frozen=True, slots=True, eq=False)
class Limbs:
    """A sub-tree with its larger inner sub-trees opened.

    Attributes:
        branches: the limbs.
        sides: much shorter chains beside a limb or between forks.
        forks: the nodes at which the limbs begin, the sub-tree's root first.
    """

    branches: tuple[Branch, ...]
    sides: tuple[Branch, ...]
    forks: tuple[int, ...]


def unfold(folding: Folding, top: int, opening: float, excluded: int | None = None) -> Limbs:
    """Return the limbs of the sub-tree at `top` with inner sub-trees opened.

    Args:
        folding: the folding of a rooted tree.
        top: the root of the sub-tree.
        opening: inner sub-trees of at least this share of the whole sub-tree are opened.
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


def nearest_node(tree: Tree, nodes: Sequence[int], point: Array) -> int:
    """Return the one of `nodes` that is nearest to `point` (3,)."""
    distances = np.linalg.norm(tree.positions[list(nodes)] - point, axis=1)
    return nodes[int(np.argmin(distances))]


def centre_node(tree: Tree, forks: Sequence[int], ends: Array, branches: Sequence[Branch]) -> int:
    """Return the node between `forks` nearest to the mean of the branches' abstracted `ends`."""
    inner = sorted({node for fork in forks for node in tree.chain(forks[0], fork)})
    if not branches:
        return forks[0]
    return nearest_node(tree, inner, weighted_mean(ends, np.array([b.length for b in branches])))


def weighted_mean(points: Array, weights: Array) -> Array:
    """Return the mean (d,) of points (n, d) by weights (n,), unweighted if all are zero."""
    mean: Array = weights @ points / weights.sum() if weights.any() else points.mean(axis=0)
    return mean
