"""A character's surface on its bones: what holds it, and what it is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.characters.character import Character
from runtime.characters.proxy import proxy_of
from solvers.deform.arap_cells import SPOKES
from solvers.deform.handles import HARD, group_targets, stretched_turns
from solvers.deform.stiff_segments import articulate
from solvers.skeleton.anchors import bind
from solvers.skeleton.tree import Tree
from solvers.squash_stretch import SquashStretchSolver
from solvers.surface.edges import Edges

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Elasticity:
    """What a surface is made of; it may be changed while the show runs.

    Attributes:
        cartoon: 0 keeps every part rigid, 1 lets it squash and stretch.
        volume_gain: how much of the volume that squash and stretch would cost is kept; more than
            1 exaggerates.
        stiffness: 0 lets limbs bend all along, towards 1 they bend at their joints only.
    """

    cartoon: float = 0.0
    volume_gain: float = 1.0
    stiffness: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Anchors:
    """Where the bones take the A anchors of a surface.

    Attributes:
        turns: (A, 4) how far each has turned from rest, quaternions (x, y, z, w).
        pivots: (A, 3) [m] where the node is about which it turns.
        lengths: (A,) how long its bone is, as a share of its length at rest.
        whole: (3, 3) what is done to the whole character afterwards.
    """

    turns: Array
    pivots: Array
    lengths: Array
    whole: Array


class DeformableSurface:
    """Binds a character's surface to its bones once, and lets it follow them.

    A dense surface is not deformed itself: a coarse proxy of it is, and it follows.

    Args:
        character: whose surface.
        tree: its nodes, hung on the one that holds it.
        energy: what is kept as rigid as possible, as of `ArapSolver`.

    Attributes:
        rest: (C, 3) [m] the surface that is deformed, at rest.
        edges: its edges.
        binding: how it hangs on the nodes.
        notes: what the user should know about it, one short line each.
    """

    def __init__(self, character: Character, tree: Tree, *, energy: str = SPOKES) -> None:
        self._proxy = proxy = proxy_of(character)
        self.rest = proxy.vertices
        self.edges = Edges.of(proxy.vertices, proxy.faces)
        self.notes = proxy.notes
        bone_of_vertex = _bones_of_weights(character, proxy.kept, tree.parents)
        self.binding = bind(
            proxy.vertices, proxy.faces, tree.parents, tree.positions, bone_of_vertex
        )
        handles, self._group = self.binding.handles, self.binding.anchor
        self._solver = SquashStretchSolver(
            proxy.vertices,
            proxy.faces,
            handles,
            energy=energy,
            groups=self._group,
            cartoon=0.0,
        )
        self._tree, self._bone_of_vertex = tree, bone_of_vertex
        self._is_articulated = False
        self._offsets = self.rest[handles] - tree.positions[self.binding.pivot[self._group]]
        bones = tree.positions[self.binding.node] - tree.positions[self.binding.pivot]
        long = np.linalg.norm(bones, axis=1, keepdims=True)
        self._axes = np.divide(bones, long, out=np.zeros_like(bones), where=long > 0.0)
        self._weights = np.full(len(bones), HARD)
        self._answer = np.empty_like(self.rest)
        self.elasticity = Elasticity()

    @property
    def elasticity(self) -> Elasticity:
        """What the surface is made of."""
        return self._elasticity

    @elasticity.setter
    def elasticity(self, elasticity: Elasticity) -> None:
        self._solver.cartoon = elasticity.cartoon
        self._solver.volume_gain = elasticity.volume_gain
        if elasticity.stiffness > 0.0 and not self._is_articulated:
            self._articulate()
        self._solver.stiffness = elasticity.stiffness
        self._elasticity = elasticity

    def _articulate(self) -> None:
        """Find the parts that may be stiff; it takes a few frames' time, once."""
        tree, proxy = self._tree, self._proxy
        parts = articulate(
            proxy.vertices,
            proxy.faces,
            tree.parents,
            tree.positions,
            self.binding.inside,
            self._bone_of_vertex,
        )
        self._solver.stiffen(parts.region_of, parts.rigidity)
        self._is_articulated = True

    @property
    def energy(self) -> float:
        """The energy of the surface as it was last deformed [m^2]."""
        return self._solver.energy

    def weigh(self, weights: Array) -> None:
        """Hold the surface at each anchor as firmly as (A,) says: see `ArapSolver.hold`."""
        if not np.array_equal(weights, self._weights):
            self._solver.weigh(weights[self._group])
            self._weights = weights

    def reset(self) -> None:
        """Forget the last answer."""
        self._solver.reset()

    def deform(self, anchors: Anchors, iterations: int) -> Array:
        """Let the deformed surface (C, 3) [m] follow its anchors; the next call overwrites it."""
        # Along its bone a ring goes as far out as the bone is longer; around it, it is thinner.
        thinning = 0.5 * self._elasticity.volume_gain
        moved = stretched_turns(anchors.turns, self._axes, anchors.lengths, thinning, anchors.whole)
        targets = group_targets(self._offsets, self._group, moved, anchors.pivots)
        self._solver.solve(targets, iterations, out=self._answer)
        self._solver.iron(self._answer)
        return self._answer

    def settle(self, iterations: int) -> None:
        """Bring the surface nearer to what its anchors ask for; what was given out stays."""
        self._solver.settle(iterations)

    def cover(self, deformed: Array) -> Array:
        """Give the character's own vertices (N, 3) [m] that go with the deformed surface (C, 3).

        They are overwritten by the next call, or are the deformed surface itself.
        """
        return self._proxy.follow(deformed)


def _bones_of_weights(character: Character, kept: Indices, parents: Indices) -> Indices | None:
    """The far end of the bone that each vertex belongs to, as the rig's weights say."""
    if character.weights is None:
        return None
    joint = np.asarray(character.weights[kept].argmax(axis=1)).ravel()
    first_child = np.full(len(parents), -1, dtype=np.int64)
    for node in range(len(parents) - 1, -1, -1):
        if parents[node] >= 0:
            first_child[parents[node]] = node
    far: Indices = np.where(first_child[joint] >= 0, first_child[joint], joint)
    return far
