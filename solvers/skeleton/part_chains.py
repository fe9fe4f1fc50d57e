"""Splits a skeleton into chains that a person can name: arms, tails, trunks, fingers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.tree import Tree

Chain = tuple[int, ...]

# A chain ends at a fork where two ways go on that are about as long as one another, and as the
# chain so far; else the longest way goes on, and the others are chains of their own. So fingers
# leave the arm whole, and the neck, whose way is shorter than the arms', ends the trunk.
_LIKE_THE_LONGEST: Final = 0.45
_LIKE_THE_CHAIN: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class PartChains:
    """The chains of a skeleton; no two share a bone.

    Attributes:
        chains: nodes of each from the root outward, two at least. All lead away from one root.
        of_node: (K,) the chain of the bone that ends at each node. Bones between the root and a
            chain that was given belong to that chain, though they are not in it. At the root it is
            the longest chain that starts there, -1 for a single node.
    """

    chains: tuple[Chain, ...]
    of_node: NDArray[np.int64]


def part_chains(tree: Tree, root: int, given: Sequence[Chain] = ()) -> PartChains:
    """Split a skeleton into chains.

    Args:
        tree: K nodes at rest.
        root: all chains lead away from this node.
        given: chains that are known, as those of a body's limbs. Chains that do not lead away from
            the root along bones, or share a bone with one before, are left out.
    """
    oriented = tree.rerooted(root)
    of_node = np.full(len(tree), -1, dtype=np.int64)
    chains: list[Chain] = []
    for chain in given:
        whole = _along_bones(oriented, chain)
        if whole is not None and (of_node[list(whole[1:])] < 0).all():
            of_node[list(whole[1:])] = len(chains)
            chains.append(whole)
    starts = {chain[0]: number for number, chain in reversed(list(enumerate(chains)))}
    for node in oriented.order[1:]:
        parent = int(oriented.parents[node])
        if of_node[node] < 0:
            chain = _grown(oriented, parent, node, of_node)
            beyond = starts.get(chain[-1])
            if beyond is None:
                of_node[list(chain[1:])] = len(chains)
                chains.append(chain)
            else:
                of_node[list(chain[1:])] = beyond
    around = [number for number, chain in enumerate(chains) if chain[0] == root]
    if around:
        of_node[root] = max(around, key=lambda number: tree.length(chains[number]))
    elif chains:
        of_node[root] = of_node[oriented.children[root][0]]
    return PartChains(tuple(chains), of_node)


def _along_bones(oriented: Tree, chain: Chain) -> Chain | None:
    """A chain with the nodes between its nodes; None where it does not lead away from the root."""
    whole = [chain[0]]
    for node in chain[1:]:
        way = oriented.chain(whole[-1], node)
        if any(oriented.parents[far] != near for near, far in pairwise(way)):
            return None
        whole.extend(way[1:])
    return tuple(whole) if len(whole) > 1 else None


def _grown(oriented: Tree, start: int, first: int, of_node: NDArray[np.int64]) -> Chain:
    """The chain from `start` over `first`, to a leaf, a fork, or where a given chain begins."""
    chain, length = [start, first], float(oriented.bone_lengths[first])
    while True:
        children = oriented.children[chain[-1]]
        free = [child for child in children if of_node[child] < 0]
        if len(free) < len(children) or not free:
            return tuple(chain)
        ways = {child: float(_reach(oriented, child)) for child in free}
        order = sorted(free, key=lambda child: (-ways[child], child))
        if len(order) > 1 and _forks(ways[order[0]], ways[order[1]], length):
            return tuple(chain)
        chain.append(order[0])
        length += float(oriented.bone_lengths[order[0]])


def _forks(longest: float, second: float, so_far: float) -> bool:
    return second >= _LIKE_THE_LONGEST * longest and second >= _LIKE_THE_CHAIN * so_far


def _reach(oriented: Tree, node: int) -> float:
    """The longest way over a node, from its parent to a leaf."""
    return float(oriented.bone_lengths[node] + oriented.heights[node])
