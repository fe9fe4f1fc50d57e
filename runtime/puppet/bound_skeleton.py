"""A character's skeleton bound to its surface: anchors on the bones, each with its handles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from runtime.characters.character import Character
from runtime.characters.proxy import Proxy
from runtime.driving.targets import (
    HandleGroups,
    HandleTargets,
    PosedNodes,
    SkinnedTargets,
    Targets,
)
from runtime.puppet.part_radii import part_radii
from solvers.deform.handles import HARD, group_targets, stretched_turns
from solvers.deform.skinning import SkinnedSurface
from solvers.deform.stiff_segments import StiffSegments, find_stiff_segments
from solvers.retarget.abstraction import abstract
from solvers.skeleton.anchors import bind
from solvers.skeleton.tree import Tree
from solvers.surface.heat_weights import is_rigid, skin_of_heat, skin_of_rigid_weights
from solvers.surface.skin_weights import Skin, skin_of_weights

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

UNTURNED = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Anchors:
    """Where the bones move the A anchors of a skeleton.

    Attributes:
        turns: (A, 4) rotation of each anchor from rest, quaternions (x, y, z, w).
        pivots: (A, 3) [m] position of the node about which each anchor turns.
        lengths: (A,) length of each anchor's bone, as a share of its length at rest.
        whole: (3, 3) linear map of the whole character, applied last.
    """

    turns: Array
    pivots: Array
    lengths: Array
    whole: Array


class BoundSkeleton:
    """Binds a skeleton to the surface that is deformed, once.

    Every bone is bound, whatever drives it, so that another match changes how the bones move and
    nothing else: no matrix is factored again while a show runs.

    Args:
        character: whose skeleton and skin weights.
        proxy: the surface that is deformed in the character's place.

    Attributes:
        root: the node that stays in place.
        tree: the nodes of the skeleton, as a tree from `root`.
        binding: the anchors, and the vertices that they hold.
        handles: the same vertices as handles, one group an anchor.
        rest_targets: the targets of the handles in the rest pose.
        rest_nodes: the nodes in the rest pose.
        at_rest: all targets of the rest pose.
    """

    def __init__(self, character: Character, proxy: Proxy) -> None:
        skeleton = character.skeleton
        tree = Tree(skeleton.parents, skeleton.rest_positions)
        self.root = abstract(tree).root
        self.tree = tree = tree.rerooted(self.root)
        self._character, self._proxy = character, proxy
        self._bone_of_vertex = _bones_of_weights(character, proxy.kept, tree.parents)
        self.binding = binding = bind(
            proxy.vertices, proxy.faces, tree.parents, tree.positions, self._bone_of_vertex
        )
        self.handles = HandleGroups(binding.handles, binding.anchor)
        near = tree.positions[binding.pivot]
        self._offsets = proxy.vertices[binding.handles] - near[binding.anchor]
        bones = tree.positions[binding.node] - near
        long = np.linalg.norm(bones, axis=1, keepdims=True)
        self._axes = np.divide(bones, long, out=np.zeros_like(bones), where=long > 0.0)
        self.rest_targets = self._rest_targets()
        self.rest_nodes = PosedNodes(tree.positions, np.tile(UNTURNED, (len(tree), 1)))
        self.at_rest = Targets(self.rest_targets, nodes=self.rest_nodes)

    def _rest_targets(self) -> HandleTargets:
        count = len(self.binding.node)
        anchors = Anchors(
            turns=np.tile(UNTURNED, (count, 1)),
            pivots=self.tree.positions[self.binding.pivot],
            lengths=np.ones(count),
            whole=np.eye(3),
        )
        positions = self.handle_positions(anchors, 0.5)
        return HandleTargets(self.handles, positions, np.full(count, HARD))

    def handle_positions(self, anchors: Anchors, thinning: float) -> Array:
        """Return the targets of the handles (H, 3) [m] that the anchors carry.

        A ring moves out along its bone as the bone grows longer, and becomes thinner around it.

        Args:
            anchors: where the bones move the anchors.
            thinning: see `stretched_turns`; 0.5 keeps the volume.
        """
        maps = stretched_turns(anchors.turns, self._axes, anchors.lengths, thinning, anchors.whole)
        return group_targets(self._offsets, self.binding.anchor, maps, anchors.pivots)

    @cached_property
    def skin(self) -> Skin:
        """The nodes that each vertex of the deformed surface follows, and their weights.

        A node carries what lies beyond it, seen from the hips of the body's plan, or else from
        the character's own root. Without weights from a file they are found when they are first
        asked for, which takes up to a second.
        """
        character, proxy = self._character, self._proxy
        if character.weights is not None:
            weights = csr_array(character.weights[proxy.kept])
            if is_rigid(weights):
                return skin_of_rigid_weights(proxy.vertices, proxy.faces, weights)
            return skin_of_weights(weights)
        tree, radii = character.skeleton.tree, None
        if character.plan is not None:
            tree = tree.rerooted(character.plan.hips)
            radii = part_radii(proxy.vertices, proxy.faces, tree, character.plan)
        return skin_of_heat(proxy.vertices, proxy.faces, tree.parents, tree.positions, radii)

    @cached_property
    def _skinned_surface(self) -> SkinnedSurface:
        return SkinnedSurface(self._proxy.vertices, self.tree.positions, self.skin)

    def skinned(self, nodes: PosedNodes) -> SkinnedTargets:
        """Return the targets of the surface that follows the posed nodes by its skin."""
        return SkinnedTargets(self._skinned_surface.place(nodes.positions, nodes.rotations))

    @cached_property
    def bone_of_vertex(self) -> Indices:
        """(N, 2) the near and the far node of the bone that each vertex of the character is on.

        Near and far are as seen from `root`. At a fork both are the fork.
        """
        binding, proxy, character = self.binding, self._proxy, self._character
        bones = np.column_stack([binding.pivot, binding.node])[binding.owner]
        if len(proxy.kept) == len(character.vertices):
            return bones
        _, nearest = cKDTree(proxy.vertices).query(character.vertices)
        every: Indices = bones[nearest]
        return every

    def limb(self, chain: tuple[int, ...]) -> tuple[int, ...]:
        """Return the part of a chain of nodes that lies outside the trunk, two nodes at least."""
        start = 0
        while start + 2 < len(chain) and self.binding.inside[chain[start + 1]]:
            start += 1
        return chain[start:]

    def stiff_segments(self) -> StiffSegments:
        """Find the segments of the surface that can be stiff. It takes as long as a few frames."""
        return find_stiff_segments(
            self._proxy.vertices,
            self._proxy.faces,
            self.tree.parents,
            self.tree.positions,
            self.binding.inside,
            self._bone_of_vertex,
        )


def _bones_of_weights(character: Character, kept: Indices, parents: Indices) -> Indices | None:
    """The far end of the bone of the greatest skin weight at each vertex; None without weights."""
    if character.weights is None:
        return None
    joint = np.asarray(character.weights[kept].argmax(axis=1)).ravel()
    first_child = np.full(len(parents), -1, dtype=np.int64)
    for node in range(len(parents) - 1, -1, -1):
        if parents[node] >= 0:
            first_child[parents[node]] = node
    far: Indices = np.where(first_child[joint] >= 0, first_child[joint], joint)
    return far
