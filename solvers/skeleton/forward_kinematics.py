"""Places a character's skeleton from the rotations of its driven bones (forward kinematics).

Source: AniMesh (Jin et al. 2015), section 5.2 and figure 5: nodes attached to a driven chain follow
it rigidly.

Rotations are world rotations from rest. A limb on a driven spine starts at the end of the moved
spine, but its direction is that of the performer's limb: the source is measured in the world as
well, so no rotation is applied twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import normalized, rotate
from solvers.kernels.short_loops import put
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Positions and rotations of the K nodes of a tree, and rotations of its bones.

    Attributes:
        positions: (K, 3).
        turns: (2 K, 4) world rotations from rest, of each node, then of the bone that ends at each
            node; no bone ends at the root.
    """

    positions: Array
    turns: Array

    @property
    def rotations(self) -> Array:
        """World rotations (K, 4) of the nodes from rest."""
        return self.turns[: len(self.positions)]


class SkeletonPose:
    """Moves the nodes of a tree with its driven chains, in every frame.

    Args:
        tree: K nodes at rest.
        root: the node that stays in place; every chain leads away from it.
        chains: node ids of the driven chains. They share no bone; a chain may start where another
            ends.

    Raises:
        ValueError: a chain does not follow bones away from the root, or a bone is driven twice.
    """

    def __init__(self, tree: Tree, root: int, chains: Sequence[Sequence[int]]) -> None:
        oriented = tree.rerooted(root)
        self._rest = oriented.positions
        self._order = np.array(oriented.order, dtype=np.int64)
        self._parents = oriented.parents
        self._links = np.column_stack([self._order, self._parents[self._order]])
        self._driver = np.full(len(tree), -1, dtype=np.int64)  # row of the bone that ends here
        self._next = np.full(len(tree), -1, dtype=np.int64)  # row of the same chain's next bone
        row = 0
        for chain in chains:
            for step, (above, node) in enumerate(pairwise(chain)):
                if oriented.parents[node] != above:
                    raise ValueError(f"Expected a chain away from node {root}, got {tuple(chain)}")
                if self._driver[node] >= 0:
                    raise ValueError(f"Expected each bone to be driven once, got {above}-{node}")
                self._driver[node] = row
                self._next[node] = row + 1 if step + 2 < len(chain) else -1
                row += 1
        self._bones = row

    def pose(self, bone_rotations: Sequence[Array]) -> tuple[Array, Array]:
        """Return rotations (K, 4) and positions (K, 3) of all nodes, as of `place`.

        Args:
            bone_rotations: for each chain, world rotations from rest (len(chain) - 1, 4).
        """
        placed = self.place(np.concatenate([np.zeros((0, 4)), *bone_rotations]))
        return placed.rotations, placed.positions

    def place(self, bone_rotations: Array) -> Placed:
        """Place all nodes for rotations of the B bones of the chains.

        A point x of the surface that follows node k goes to R_k (x - rest_k) + position_k. Inside a
        chain a node has the rotation of the bone that starts at it, like a joint of a rig, and so
        do the nodes attached there. At a chain's end a node has the rotation of the last bone. A
        node where a chain starts, and all other nodes, follow their parents.

        Args:
            bone_rotations: (B, 4) world rotations from rest, chain after chain.

        Raises:
            ValueError: the number of rotations differs from that of driven bones.
        """
        if bone_rotations.shape != (self._bones, 4):
            raise ValueError(
                f"Expected {self._bones} rotations of driven bones, got shape"
                f" {bone_rotations.shape}"
            )
        given = np.ascontiguousarray(bone_rotations, dtype=np.float64)
        placed = Placed(np.empty((len(self._rest), 3)), np.empty((2 * len(self._rest), 4)))
        _forward(
            self._links, self._rest, self._driver, self._next, given, placed.turns, placed.positions
        )
        return placed

    def stretched(self, positions: Array, shares: Array) -> Array:
        """Return nodes at (K, 3), moved so that the bone that ends at each is `shares` as long."""
        out = np.empty_like(positions)
        _stretch(self._links, positions, shares, out)
        return out


def pose(
    tree: Tree, root: int, chains: Sequence[Sequence[int]], bone_rotations: Sequence[Array]
) -> tuple[Array, Array]:
    """Return rotations (K, 4) and positions (K, 3) of all nodes; see `SkeletonPose`."""
    return SkeletonPose(tree, root, chains).pose(bone_rotations)


@kernel
def _forward(
    links: Ints,
    rest: Array,
    driver: Ints,
    following: Ints,
    given: Array,
    turns: Array,
    positions: Array,
) -> None:
    """Place each node after its parent; `turns` as of `Placed`."""
    rotations, bones = turns[: len(rest)], turns[len(rest) :]
    for step in range(len(links)):
        node, parent = links[step, 0], links[step, 1]
        if parent < 0:
            put(rotations[node], (0.0, 0.0, 0.0, 1.0))
            put(bones[node], (0.0, 0.0, 0.0, 1.0))
            put(positions[node], rest[node])
            continue
        above = rotations[parent]
        bone = (above[0], above[1], above[2], above[3])
        if driver[node] >= 0:
            own = given[driver[node]]
            bone = normalized((own[0], own[1], own[2], own[3]))
        bones[node, 0], bones[node, 1], bones[node, 2], bones[node, 3] = bone
        offset = rotate(
            bone,
            (
                rest[node, 0] - rest[parent, 0],
                rest[node, 1] - rest[parent, 1],
                rest[node, 2] - rest[parent, 2],
            ),
        )
        for k in range(3):
            positions[node, k] = positions[parent, k] + offset[k]
        if following[node] >= 0:
            own = given[following[node]]
            bone = normalized((own[0], own[1], own[2], own[3]))
        rotations[node, 0], rotations[node, 1], rotations[node, 2], rotations[node, 3] = bone


@kernel
def _stretch(links: Ints, positions: Array, shares: Array, out: Array) -> None:
    """Move each node with its parent, and along its bone by the bone's change of length."""
    for step in range(len(links)):
        node, parent = links[step, 0], links[step, 1]
        for k in range(3):
            out[node, k] = positions[node, k]
            if parent >= 0:
                bone = positions[node, k] - positions[parent, k]
                out[node, k] = out[parent, k] + shares[node] * bone
