"""The chains of a character that are driven: how they move its nodes and the anchors on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.puppet.bound_skeleton import Anchors, BoundSkeleton
from solvers.deform.handles import HARD
from solvers.skeleton.forward_kinematics import Placed, SkeletonPose

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class DrivenChains:
    """D chains of the K nodes of a character; assembled once for a mapping, posed every frame.

    Args:
        skeleton: the character's skeleton, with A anchors.
        root: the node that stays in place; every chain leads away from it.
        chains: nodes of each chain. They share no bone.

    Attributes:
        starts: (D,) first node of each chain.
        tips: (D,) last node of each chain.
        limb_of_node: (K,) chain of the bone that ends at each node, -1 for none.
        limb_of_bone: (A,) chain of each anchor's bone, -1 for none.

    Raises:
        ValueError: a chain that does not lead away from the root, or a bone driven twice.
    """

    def __init__(
        self, skeleton: BoundSkeleton, root: int, chains: Sequence[tuple[int, ...]]
    ) -> None:
        tree, binding = skeleton.tree, skeleton.binding
        self._pose = SkeletonPose(tree, root, chains)
        oriented = tree.rerooted(root)
        self._parents, self._order = oriented.parents, oriented.order
        self.starts = np.array([chain[0] for chain in chains], dtype=np.int64)
        self.tips = np.array([chain[-1] for chain in chains], dtype=np.int64)
        self.limb_of_node = np.full(len(tree), -1, dtype=np.int64)
        for number, chain in enumerate(chains):
            self.limb_of_node[list(chain[1:])] = number
        self._binding = binding
        node, pivot = binding.node, binding.pivot
        # A bone is named by its end away from the root, which may not be the binding's root.
        bone = np.where(self._parents[pivot] == node, pivot, node)
        bone[node == pivot] = -1
        self._bone_or_node = np.where(bone >= 0, bone, node)
        # Rows of `Placed.turns`: an anchor without a bone turns with its node.
        self._turn_of_anchor = np.where(bone >= 0, bone + len(tree), node)
        self.limb_of_bone = np.where(bone >= 0, self.limb_of_node[bone], -1)
        self._limb_of_anchor = self._chain_above()[self._bone_or_node]

    def _chain_above(self) -> Indices:
        """For each node (K,) the chain that moves it, or that it rides on; -1 for none."""
        chain_of = self.limb_of_node.copy()
        for node in self._order:
            if chain_of[node] < 0 and self._parents[node] >= 0:
                chain_of[node] = chain_of[self._parents[node]]
        return chain_of

    def place(self, turns: Array) -> Placed:
        """Return where the nodes are when the bones of the chains are turned by (B, 4)."""
        return self._pose.place(turns)

    def stretched(self, positions: Array, lengths: Array) -> Array:
        """Return where nodes at (K, 3) [m] are when their bones are `lengths` (K,) as long."""
        return self._pose.stretched(positions, lengths)

    def anchors(self, placed: Placed, positions: Array, lengths: Array, whole: Array) -> Anchors:
        """Return where the bones move the anchors.

        Args:
            placed: the turns of nodes and bones.
            positions: (K, 3) [m] the nodes.
            lengths: (A,) and
            whole: (3, 3) as of `Anchors`.
        """
        pivots = positions[self._binding.pivot]
        return Anchors(placed.turns[self._turn_of_anchor], pivots, lengths, whole)

    def weights(self, of_limbs: Array) -> Array:
        """Return how firmly each anchor is held (A,), from (D,) of each chain."""
        return np.append(of_limbs, HARD)[self._limb_of_anchor]

    def pulls(self, ends: Indices) -> NDArray[np.bool_]:
        """Return which chains pull at each edge (E, D): they bend it, or move one end only.

        Args:
            ends: (E, 2) vertices of the deformed surface.
        """
        count = len(self.starts)
        bent = self.limb_of_node[:, None] == np.arange(count)
        moved = bent.copy()
        for node in self._order:
            if self._parents[node] >= 0:
                moved[node] |= moved[self._parents[node]]
        near, far = self._bone_or_node[self._binding.owner][ends].T
        pulls: NDArray[np.bool_] = bent[near] | bent[far] | (moved[near] != moved[far])
        return pulls
