"""Blends a character from its old pose after a change during the show, so that it never jumps.

Another driver, another match or rest state, and exchanged sides move a character elsewhere at once.
Each node turns the short way from where it was, as bones do after a freeze; the surface follows the
turned nodes, and what then remains between both surfaces fades. The performer's motion goes on
meanwhile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from runtime.driving.targets import HandleTargets, PosedNodes, SkinnedTargets, Targets
from runtime.driving.unfreeze_blend import LONGEST_STEP, SECONDS
from runtime.puppet.bound_skeleton import BoundSkeleton
from solvers.skeleton.quaternions import conjugate, multiply, rotate

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """A character as it was shown before a change: its targets, and its vertices (N, 3) [m]."""

    targets: Targets
    vertices: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Offset:
    """How far what was shown is from what the character does now.

    Attributes:
        turns: (K, 4) of the nodes, quaternions with w >= 0; none where nodes are not known.
        bones: (K, 3) [m] what the turns leave of the way from each node's parent to the node.
        turn: [rad] of the whole, in [-pi, pi).
        travel: (2,) [m] of the whole.
    """

    turns: Array
    bones: Array
    turn: float
    travel: Array


@dataclass(frozen=True, slots=True, eq=False)
class ChangeBlendState:
    """The state of a `ChangeBlend` between two frames.

    Attributes:
        shown: what was shown when a blend was asked for that has not begun; None for none.
        offset: what the blend started from; None at its end.
        rest_of_way: (N, 3) [m] what it leaves between the surfaces; None before it is known.
        passed: [s] since it began.
        at: [s] of the last frame.
    """

    shown: _Shown | None
    offset: _Offset | None
    rest_of_way: Array | None
    passed: float
    at: float


class ChangeBlend:
    """Eases one character over its changes.

    Args:
        skeleton: of the character.
    """

    def __init__(self, skeleton: BoundSkeleton) -> None:
        self._skeleton = skeleton
        tree = skeleton.tree
        self._order = [node for node in tree.order if tree.parents[node] >= 0]
        self._parents = np.where(tree.parents < 0, np.arange(len(tree)), tree.parents)
        self.reset()

    def reset(self) -> None:
        """Forget all changes: what comes is shown at once."""
        self._shown: _Shown | None = None
        self._offset: _Offset | None = None
        self._rest_of_way: Array | None = None
        self._passed, self._at = 0.0, -math.inf

    def snapshot(self) -> ChangeBlendState:
        """Return what is remembered between frames."""
        return ChangeBlendState(
            self._shown, self._offset, self._rest_of_way, self._passed, self._at
        )

    def restore(self, state: ChangeBlendState) -> None:
        """Go back to a snapshot."""
        self._shown, self._offset = state.shown, state.offset
        self._rest_of_way, self._passed, self._at = state.rest_of_way, state.passed, state.at

    def begin(self, targets: Targets, vertices: Array) -> None:
        """Blend from what is shown now, if anything is, from the next frame on.

        Args:
            targets: as they were blended.
            vertices: (N, 3) [m] on the stage.
        """
        if self.has_shown:
            self._shown = _Shown(targets, vertices.copy())

    @property
    def has_shown(self) -> bool:
        """Whether any frame was followed."""
        return self._at > -math.inf

    def follow(self, targets: Targets, time: float) -> Targets:
        """Return the targets to show at `time` [s] of the performer; for a moment a blend.

        While the time stands still, what was shown before the change stays.
        """
        step = min(max(time - self._at, 0.0), LONGEST_STEP)
        self._at = time
        if self._shown is not None:
            self._offset = self._between(self._shown.targets, targets)
            self._rest_of_way, self._passed = None, 0.0
        if self._offset is None:
            return targets
        self._passed += step
        if self._passed >= SECONDS:
            self._shown = self._offset = self._rest_of_way = None
            return targets
        return self._eased(targets, self._offset)

    def ease(self, vertices: Array) -> None:
        """Move the vertices (N, 3) [m], on the stage, of the targets that `follow` returned."""
        if self._offset is None:
            return
        if self._shown is not None:
            self._rest_of_way = self._shown.vertices - vertices
            if self._passed > 0.0:
                self._shown = None
        if self._rest_of_way is not None:
            vertices += self._left * self._rest_of_way
            vertices[:, 1] += max(-float(vertices[:, 1].min()), 0.0)

    @property
    def _left(self) -> float:
        """The share of the way that is left."""
        left = 1.0 - self._passed / SECONDS
        return left * left * (3.0 - 2.0 * left)

    def _between(self, shown: Targets, targets: Targets) -> _Offset:
        turns, bones = np.empty((0, 4)), np.empty((0, 3))
        if shown.nodes is not None and targets.nodes is not None:
            turns = multiply(shown.nodes.rotations, conjugate(targets.nodes.rotations))
            turns = np.where(turns[:, 3:] < 0.0, -turns, turns)
            bones = self._bones(shown.nodes) - self._turned(turns, targets.nodes)
        before, now = shown.placement, targets.placement
        return _Offset(
            turns=turns,
            bones=bones,
            turn=(before.turn - now.turn + np.pi) % (2.0 * np.pi) - np.pi,
            travel=np.subtract(before.travel, now.travel),
        )

    def _eased(self, targets: Targets, offset: _Offset) -> Targets:
        """The targets, moved by what is left of the offset."""
        left, placement = self._left, targets.placement
        x, z = placement.travel + left * offset.travel
        placement = replace(placement, turn=placement.turn + left * offset.turn, travel=(x, z))
        if targets.nodes is None or not len(offset.turns):
            return replace(targets, placement=placement)
        turns = _share(offset.turns, left)
        positions = self._turned(turns, targets.nodes) + left * offset.bones
        for node in self._order:
            positions[node] += positions[self._parents[node]]
        nodes = PosedNodes(positions, multiply(turns, targets.nodes.rotations))
        shape = self._shape(targets, nodes, turns)
        return Targets(shape, placement, nodes)

    def _shape(
        self, targets: Targets, nodes: PosedNodes, turns: Array
    ) -> HandleTargets | SkinnedTargets | Array:
        """The shape of targets that follows nodes which were turned by turns (K, 4)."""
        shape, before, skeleton = targets.shape, targets.nodes, self._skeleton
        if isinstance(shape, SkinnedTargets):
            return replace(skeleton.skinned(nodes), firmness=shape.firmness)
        if isinstance(shape, HandleTargets) and before is not None:
            pivots = skeleton.binding.pivot[shape.handles.group_of]
            ways = rotate(turns[pivots], shape.positions - before.positions[pivots])
            return replace(shape, positions=nodes.positions[pivots] + ways)
        return shape

    def _bones(self, nodes: PosedNodes) -> Array:
        """The way (K, 3) [m] from each node's parent to the node; of the root from the origin."""
        bones = nodes.positions - nodes.positions[self._parents]
        bones[self._skeleton.root] = nodes.positions[self._skeleton.root]
        return bones

    def _turned(self, turns: Array, nodes: PosedNodes) -> Array:
        """The same ways, each turned (K, 4) as its parent; that to the root as it is."""
        bones, root = self._bones(nodes), self._skeleton.root
        ways = rotate(turns[self._parents], bones)
        ways[root] = bones[root]
        return ways


def _share(turns: Array, share: float) -> Array:
    """Rotations (K, 4) by a share of the angles of others, which have w >= 0."""
    sines = np.linalg.norm(turns[:, :3], axis=1, keepdims=True)
    half = share * np.arctan2(sines, turns[:, 3:])
    axes = turns[:, :3] / np.maximum(sines, 1e-12)
    return np.concatenate([np.sin(half) * axes, np.cos(half)], axis=1)
