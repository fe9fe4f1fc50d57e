"""A part: a tree of bones whose modelling and animation are kept apart, as frozen values.

The convention, for every bone b with the bone before it, b - 1, and at every time t:

    G_b(t) = G_b-1(t) M_1 A_1(t) M_2 A_2(t) ...        x_b(t) = x_b-1(t) + G_b(t) d_b

G_b is the rotation of the bone that *ends* at node b, since rest; so the branches of a fork turn
each on its own. x_b is where the node is, d_b the bone at rest. At the root G_r(t) = M_1 A_1(t) ...
and x_r is fixed. M is what modelling made (posing, cuts, merges), A what clips make. Most bones
have one pair M A; a bone that was joined from several keeps the pairs of all (figure 13), each with
the place along the bone where it ends, so that it can be parted there again.

A layer of a pair says where its clip is entered and left: A(t) = q(first, t)^-1 q(last, t). Two
places of the source, not one share of it, are what makes edits exact at every time: a node that is
added divides the interval, a cut gives all of it to both sides. Where several layers meet, or one
counts only in part, their logarithms add up:

    A = Q(first)^-1 Q(last),   Q(s) = exp(sum_i w_i log(q_i(entry_i)^-1 q_i(s_i)))

Source: AniMesh (Jin et al. 2015), section 6, which leaves order and intervals open.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.editing.motion import UNTURNED, Clip, Quaternion
from solvers.skeleton.tree import Tree

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Layer:
    """The part of a clip that a turn uses.

    Attributes:
        clip: the clip.
        entry: parameter s of the clip where the bone began on which it was laid.
        first, last: parameters between which the turn lies; `first` > `last` turns back.
    """

    clip: Clip
    entry: float
    first: float
    last: float

    @property
    def reversed(self) -> Layer:
        """The layer that undoes this one."""
        return replace(self, first=self.last, last=self.first)


@dataclass(frozen=True, slots=True)
class Turn:
    """A pair M A.

    Attributes:
        end: where along the bone's stem it ends; it begins where the one before it ends.
        model: M, a unit quaternion.
        layers: of A.
    """

    end: float
    model: Quaternion = UNTURNED
    layers: tuple[Layer, ...] = ()


@dataclass(frozen=True, slots=True)
class Bone:
    """A straight bone: the piece from `start` to `end` of its stem.

    Pieces of one stem know each other: joined again they are the whole, to the last bit.

    Attributes:
        stem: (x, y, z) at rest, any unit; zero at a root.
        start, end: the piece, in shares of the stem.
        turns: from the bone before it, in order; one at least, and the last ends at `end`.
    """

    stem: Vector
    start: float = 0.0
    end: float = 1.0
    turns: tuple[Turn, ...] = (Turn(1.0),)

    @property
    def vector(self) -> NDArray[np.float64]:
        """(3,) d, the bone at rest."""
        out: NDArray[np.float64] = (self.end - self.start) * np.array(self.stem)
        return out

    @property
    def length(self) -> float:
        """Of the bone, in the stem's unit."""
        return float(np.linalg.norm(self.vector))

    def spans(self) -> Iterator[tuple[float, float, Turn]]:
        """Yield each turn with where along the stem it begins and ends."""
        begin = self.start
        for turn in self.turns:
            yield begin, turn.end, turn
            begin = turn.end


@dataclass(frozen=True, slots=True)
class Node:
    """A node, and the bone that ends there.

    Attributes:
        id: of the node, unique in its part.
        parent: id of the node that the bone starts at; -1 at the root.
        bone: at the root only its turns count.
    """

    id: int
    parent: int
    bone: Bone


@dataclass(frozen=True)
class Part:
    """An animated shape: what is cut, copied, and merged. Edits make new ones.

    Attributes:
        place: (x, y, z) of the root in the world.
        nodes: every parent before its children; the root first.

    Raises:
        ValueError: nodes that are no tree in this order, or two with one id.
    """

    place: Vector
    nodes: tuple[Node, ...]

    def __post_init__(self) -> None:
        known: set[int] = set()
        for node in self.nodes:
            if node.id in known or node.id < 0:
                raise ValueError(f"Expected every id once and not negative, got {node.id}")
            if (node.parent in known) != bool(known) or (not known and node.parent != -1):
                raise ValueError(f"Expected the parent of node {node.id} before it, and one root")
            known.add(node.id)
        if not known:
            raise ValueError("Expected at least one node")

    def __len__(self) -> int:
        return len(self.nodes)

    @cached_property
    def index(self) -> dict[int, int]:
        """Where each node stands in `nodes`, by its id."""
        return {node.id: at for at, node in enumerate(self.nodes)}

    @property
    def root(self) -> Node:
        """The node without a parent."""
        return self.nodes[0]

    @property
    def next_id(self) -> int:
        """The id that the next new node gets."""
        return max(self.index) + 1

    def node(self, number: int) -> Node:
        """Return the node with this id.

        Raises:
            ValueError: there is none.
        """
        if number not in self.index:
            there = ", ".join(str(known) for known in sorted(self.index)[:12])
            raise ValueError(f"there is no node {number}; there are: {there}")
        return self.nodes[self.index[number]]

    def children(self, number: int) -> tuple[Node, ...]:
        """Return the nodes whose bones start at a node."""
        return tuple(node for node in self.nodes if node.parent == number)

    def branch(self, number: int) -> tuple[Node, ...]:
        """Return a node and all beyond it, parents first."""
        found = {self.node(number).id: self.node(number)}
        for node in self.nodes:
            if node.parent in found:
                found[node.id] = node
        return tuple(found.values())

    def path(self, number: int) -> tuple[Node, ...]:
        """Return the nodes from the root to a node."""
        way = [self.node(number)]
        while way[-1].parent >= 0:
            way.append(self.node(way[-1].parent))
        return tuple(reversed(way))

    def with_bone(self, number: int, bone: Bone) -> Part:
        """Return the part with another bone at a node."""
        changed = replace(self.node(number), bone=bone)
        return replace(
            self, nodes=tuple(changed if node.id == number else node for node in self.nodes)
        )


def root_node(number: int, turns: tuple[Turn, ...] = (Turn(1.0),)) -> Node:
    """Return a root: a node without a bone, turned by `turns`."""
    return Node(number, -1, Bone((0.0, 0.0, 0.0), turns=turns))


def part_of(positions: NDArray[np.float64], parents: NDArray[np.int64]) -> Part:
    """Return a part without motion.

    Args:
        positions: (K, 3) of the nodes at rest.
        parents: (K,) index of each node's parent, -1 for the one root. Indices become ids.

    Raises:
        ValueError: as of `solvers.skeleton.tree.Tree`.
    """
    tree = Tree(parents, positions)
    nodes = [root_node(tree.root)]
    for at in tree.order[1:]:
        parent = int(tree.parents[at])
        nodes.append(Node(at, parent, Bone(vector_of(tree.positions[at] - tree.positions[parent]))))
    return Part(vector_of(tree.positions[tree.root]), tuple(nodes))


def vector_of(row: NDArray[np.float64]) -> Vector:
    """Return a row (3,) as numbers of its own."""
    x, y, z = row.tolist()
    return x, y, z


def quaternion_of(row: NDArray[np.float64]) -> Quaternion:
    """Return a row (4,) as a unit quaternion of its own."""
    x, y, z, w = (row / np.linalg.norm(row)).tolist()
    return x, y, z, w
