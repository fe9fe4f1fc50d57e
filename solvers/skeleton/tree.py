"""A skeleton as a tree of nodes in space, for matching and for posing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray


def children_of(parents: NDArray[np.int64]) -> tuple[tuple[int, ...], ...]:
    """Return the children of each node, ascending, from `parents` (K,), -1 for a root."""
    children: list[list[int]] = [[] for _ in parents]
    for node, parent in enumerate(parents.tolist()):
        if parent >= 0:
            children[parent].append(node)
    return tuple(map(tuple, children))


def parents_first(parents: NDArray[np.int64]) -> tuple[int, ...]:
    """Return the nodes of a tree with every parent before its children.

    Args:
        parents: (K,) index of each node's parent, -1 for the one root.

    Raises:
        ValueError: `parents` do not form one tree; the message completes "expected".
    """
    roots = np.flatnonzero(parents == -1)
    if len(roots) != 1:
        raise ValueError(f"exactly one root, got {len(roots)}")
    if parents.min() < -1 or parents.max() >= len(parents):
        raise ValueError("parents that form a tree")
    children = children_of(parents)
    order = roots.tolist()
    for node in order:
        order.extend(children[node])
    if len(order) != len(parents):
        raise ValueError("parents that form a tree")
    return tuple(order)


@dataclass(frozen=True, eq=False)
class Tree:
    """Nodes joined by bones; `parents` define the root, but queries also serve the unrooted tree.

    Attributes:
        parents: (K,) int; index of each node's parent, -1 for the one root. Any order.
        positions: (K, 3) rest positions in one frame, any unit.

    Raises:
        ValueError: no node, a wrong shape, a position that is not finite, or parents that do not
            form one tree.
    """

    parents: NDArray[np.int64]
    positions: NDArray[np.float64]

    def __post_init__(self) -> None:
        parents = np.array(self.parents)
        positions = np.array(self.positions, dtype=np.float64)
        if parents.ndim != 1 or parents.size == 0:
            raise ValueError(f"Expected `parents` to have shape (K,), K > 0, got {parents.shape}")
        if not np.issubdtype(parents.dtype, np.integer):
            raise ValueError(f"Expected `parents` to hold integers, got {parents.dtype}")
        if positions.shape != (len(parents), 3):
            raise ValueError(
                f"Expected `positions` to have shape ({len(parents)}, 3), got {positions.shape}"
            )
        if not np.isfinite(positions).all():
            raise ValueError("Expected `positions` to be finite")
        parents = parents.astype(np.int64)
        parents.setflags(write=False)
        positions.setflags(write=False)
        object.__setattr__(self, "parents", parents)
        object.__setattr__(self, "positions", positions)
        try:
            parents_first(parents)
        except ValueError as error:
            raise ValueError(f"Expected {error}") from error

    def __len__(self) -> int:
        return len(self.parents)

    @cached_property
    def root(self) -> int:
        """The node without a parent."""
        return int(np.flatnonzero(self.parents == -1)[0])

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """Each node's children, in ascending order."""
        return children_of(self.parents)

    @cached_property
    def neighbours(self) -> tuple[tuple[int, ...], ...]:
        """Each node's neighbours in the unrooted tree, in ascending order."""
        return tuple(
            tuple(sorted((*below, parent))) if parent >= 0 else below
            for below, parent in zip(self.children, self.parents.tolist(), strict=True)
        )

    @cached_property
    def order(self) -> tuple[int, ...]:
        """The nodes with every parent before its children."""
        return parents_first(self.parents)

    @cached_property
    def degree(self) -> NDArray[np.int64]:
        """(K,) number of neighbours: 1 at a leaf, 2 on a chain, more at a fork (section 4.1)."""
        return np.array([len(around) for around in self.neighbours], dtype=np.int64)

    @cached_property
    def leaves(self) -> tuple[int, ...]:
        """The nodes with at most one neighbour; the root may be one."""
        return tuple(np.flatnonzero(self.degree <= 1).tolist())

    @cached_property
    def bone_lengths(self) -> NDArray[np.float64]:
        """(K,) distance of each node to its parent; 0 at the root."""
        to_parent = self.positions - self.positions[np.maximum(self.parents, 0)]
        lengths: NDArray[np.float64] = np.linalg.norm(to_parent, axis=1)
        lengths[self.root] = 0.0
        return lengths

    @cached_property
    def heights(self) -> NDArray[np.float64]:
        """(K,) length of the longest path from each node down to a leaf below it."""
        heights = np.zeros(len(self))
        for node in reversed(self.order[1:]):
            parent = self.parents[node]
            heights[parent] = max(heights[parent], heights[node] + self.bone_lengths[node])
        return heights

    @cached_property
    def centroid(self) -> NDArray[np.float64]:
        """(3,) centre of mass of the bones, each with its length as its mass."""
        lengths = self.bone_lengths
        if lengths.sum() == 0.0:
            mean: NDArray[np.float64] = self.positions.mean(axis=0)
            return mean
        middles = 0.5 * (self.positions + self.positions[np.maximum(self.parents, 0)])
        centre: NDArray[np.float64] = lengths @ middles / lengths.sum()
        return centre

    def chain(self, start: int, end: int) -> tuple[int, ...]:
        """Return the nodes on the path from `start` to `end`, both included."""
        up = [start]
        while self.parents[up[-1]] >= 0:
            up.append(int(self.parents[up[-1]]))
        above = {node: step for step, node in enumerate(up)}
        down = [end]
        while down[-1] not in above:
            down.append(int(self.parents[down[-1]]))
        return (*up[: above[down[-1]]], *reversed(down))

    def length(self, chain: Sequence[int]) -> float:
        """Return the length of the polyline through the nodes of `chain`."""
        points = self.positions[list(chain)]
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())

    def subtree(self, node: int, away_from: int | None = None) -> tuple[int, ...]:
        """Return `node` and all nodes beyond it, seen from `away_from` (by default its parent)."""
        blocked = int(self.parents[node]) if away_from is None else away_from
        found = [(node, blocked)]
        for here, before in found:
            found.extend((there, here) for there in self.neighbours[here] if there != before)
        return tuple(here for here, _ in found)

    def rerooted(self, root: int) -> Tree:
        """Return the same nodes and bones with `root` as the root."""
        if root == self.root:
            return self
        parents = self.parents.copy()
        path = self.chain(self.root, root)
        parents[list(path[:-1])] = path[1:]
        parents[root] = -1
        return Tree(parents, self.positions)


def extend_to_leaf(tree: Tree, chain: ArrayLike) -> tuple[int, ...]:
    """Extend a chain of at least two nodes along the longest path to a leaf.

    Source: AniMesh (Jin et al. 2015), section 5.2 and figure 5, right.
    """
    nodes = tuple(int(node) for node in np.asarray(chain, dtype=np.int64))
    if len(nodes) < 2:
        raise ValueError(f"Expected `chain` to have at least two nodes, got {len(nodes)}")
    end, before = nodes[-1], nodes[-2]
    reach = {end: (0.0, before)}
    for node in tree.subtree(end, before)[1:]:
        came_from = next(there for there in tree.neighbours[node] if there in reach)
        step = float(np.linalg.norm(tree.positions[node] - tree.positions[came_from]))
        reach[node] = (reach[came_from][0] + step, came_from)
    tips = [node for node in reach if len(tree.neighbours[node]) == 1]
    tip = max(tips, key=lambda node: (reach[node][0], -node), default=end)
    return (*nodes[:-1], *tree.chain(end, tip))
