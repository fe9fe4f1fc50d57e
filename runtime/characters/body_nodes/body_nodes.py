"""Nodes for driving a bare mesh limb by limb: alike on both sides, with hips, chest and a spine.

An extracted skeleton is good for matching, but not for posing: its joints are where its separators
happened to lie, its hips where two thighs can be told apart, and a short trunk is one node that
cannot bend. Here the nodes of a body are placed anew along the lines of its limbs. The extracted
skeleton stays what chains are matched with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Limb
from devices.bodies.joint_names import Side
from devices.bodies.limb_segments import arm_segments, leg_segments
from devices.skeleton import Skeleton
from runtime.characters.body_nodes.crotch import crotch_height, thigh_line
from runtime.characters.body_nodes.limb_lines import (
    Segments,
    divided,
    made_alike,
    outside_trunk,
)
from runtime.characters.character import Body
from solvers.skeleton.limbs import closest_bones
from solvers.skeleton.mirror_plane import SYMMETRIC, MirrorPlane
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Chain = tuple[int, ...]
Lines = Mapping[Side, Array]

_SPINE = 4  # bones of the trunk
_SHORT = 0.04  # of the size: a trunk that is shorter does not bend
_MERGED = 0.05  # of the size: legs that fork so far below the crotch are told apart by slices
_ANKLE = 0.05  # of the size: height of an ankle above the sole
_COLUMN = 0.5  # of its length: a leg that is thicker is a column
_FEW = 3  # nodes: a trunk of fewer begins at the hips themselves


def body_nodes(
    vertices: Array,
    faces: Indices,
    points: Array,
    tree: Tree,
    plan: BodyPlan,
    plane: MirrorPlane,
) -> Body:
    """Return nodes along the limbs of a body, and their plan.

    Args:
        vertices: (N, 3) [m] surface at rest.
        faces: (F, 3) into `vertices`.
        points: (n, 3) [m] spread evenly over the surface.
        tree: the extracted skeleton.
        plan: the parts of the body, of the nodes of `tree`.
        plane: the mirror plane between its left and right.
    """
    return _BodyNodes(vertices, faces, points, tree, plan, plane).body()


@dataclass(slots=True)
class _Nodes:
    """Nodes that are collected, parents first."""

    places: list[Array] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)

    def add(self, place: Array, parent: int) -> int:
        self.places.append(place)
        self.parents.append(parent)
        return len(self.places) - 1

    def chain(self, start: int, places: Array) -> Chain:
        """Add a chain of nodes beyond `start`, which comes first in the answer."""
        nodes = [start]
        for place in places:
            nodes.append(self.add(place, nodes[-1]))
        return tuple(nodes)


class _BodyNodes:
    def __init__(
        self,
        vertices: Array,
        faces: Indices,
        points: Array,
        tree: Tree,
        plan: BodyPlan,
        plane: MirrorPlane,
    ) -> None:
        self._vertices, self._faces, self._points = vertices, faces, points
        self._tree, self._plan, self._plane = tree, plan, plane
        self._size = float(np.ptp(points, axis=0).max())
        self._even = plane.asymmetry < SYMMETRIC

    def body(self) -> Body:
        plan = self._plan
        legs = self._alike(self._leg_lines())
        arms = self._alike(
            {s: outside_trunk(self._line(limb.chain)) for s, limb in plan.arms.items()}
        )
        spine, neck = self._spine(legs, arms)
        nodes = _Nodes()
        root = nodes.add(spine[0], -1)
        trunk = nodes.chain(root, spine[1:])
        head = nodes.chain(trunk[-1], neck) if len(neck) else ()
        new_legs = self._limbs(nodes, legs, root, leg_segments)
        new_arms = self._limbs(nodes, arms, trunk[-1], arm_segments)
        tail: Chain = ()
        if plan.tail:
            line = self._line(plan.tail)
            tail = nodes.chain(_nearest(nodes.places, trunk, line[0]), line[1:])
        skull = self._skull(nodes, head)
        self._hang_rest(nodes, [trunk, head, tail, *_chains(new_legs), *_chains(new_arms)])
        positions = np.array(nodes.places)
        names = tuple(f"node{number}" for number in range(len(positions)))
        skeleton = Skeleton(names, np.array(nodes.parents, dtype=np.int64), positions)
        body_plan = BodyPlan(
            trunk=trunk,
            head=head,
            skull=skull,
            arms=new_arms,
            legs=new_legs,
            tail=tail,
            arm_word=plan.arm_word,
            leg_word=plan.leg_word,
        )
        return Body(skeleton, body_plan)

    # Lines.

    def _line(self, chain: Sequence[int]) -> Array:
        line: Array = self._tree.positions[list(chain)]
        return line

    def _alike(self, lines: Lines) -> dict[Side, Array]:
        """Both lines of a pair, evenly sampled, and mirror images where they nearly are."""
        if len(lines) < len(SIDES):
            return dict(lines)
        one, other = made_alike(lines[Side.LEFT], lines[Side.RIGHT], self._plane, self._size)
        return {Side.LEFT: one, Side.RIGHT: other}

    def _leg_lines(self) -> dict[Side, Array]:
        """Lines along the legs, which begin above the crotch where they stand on two."""
        plan = self._plan
        lines = {side: self._line(limb.chain) for side, limb in plan.legs.items()}
        if len(lines) < len(SIDES) or plan.arm_word == "foreleg" or not plan.arms:
            return lines
        positions = self._tree.positions
        start = float(np.mean([positions[arm.upper[0], 1] for arm in plan.arms.values()]))
        crotch = crotch_height(self._vertices, self._faces, self._plane, start)
        tree = self._tree.rerooted(plan.hips)
        arms = [node for arm in plan.arms.values() for node in tree.subtree(arm.upper[1])]
        nearest, _ = closest_bones(self._points, tree.parents, tree.positions)
        points = self._points[~np.isin(nearest, arms)]
        found = {}
        for side, line in lines.items():
            foot = np.sign(self._plane.distance(line[-1:])[0])
            # Where two legs were one to the skeleton, it is of no use above the feet.
            merged = line[0, 1] < crotch - _MERGED * self._size
            sole = float(line[-1, 1])
            ankle = sole + _ANKLE * self._size
            knee = ankle if merged else float(line[line[:, 1] < crotch, 1].max(initial=ankle))
            thigh, width = thigh_line(points, self._plane, foot, crotch, knee)
            if not len(thigh) or line[0, 1] >= thigh[0, 1]:
                return lines
            if width > _COLUMN * (thigh[0, 1] - sole):  # the skeleton ends at a side of the sole
                found[side], _ = thigh_line(points, self._plane, foot, crotch, sole)
                continue
            lower = line[:, 1] < thigh[-1, 1]
            beyond = line[int(np.argmax(lower)) :] if lower.any() else line[-1:]
            found[side] = np.vstack([thigh, line[-1:] if merged else beyond])
        return found

    def _spine(self, legs: Lines, arms: Lines) -> tuple[Array, Array]:
        """The nodes of the trunk from the hips to the chest, and those of neck and head beyond."""
        plan = self._plan
        trunk, head = list(plan.trunk), list(plan.head[1:])
        line = self._line(trunk)
        if len(legs) == len(SIDES):
            hips = np.mean([leg[0] for leg in legs.values()], axis=0)
            if len(trunk) < _FEW:
                line = np.vstack([hips, line])
            elif plan.arm_word != "foreleg" and line[0, 1] < hips[1]:
                line = np.vstack([hips, line[line[:, 1] > hips[1] + _SHORT * self._size]])
        whole = np.vstack([line, self._line(head)]) if head else line
        if self._even:
            whole = whole - self._plane.distance(whole)[:, None] * self._plane.normal
        if len(arms) == len(SIDES):
            chest = _place_on(whole, np.mean([arm[0] for arm in arms.values()], axis=0))
        else:
            chest = float(_lengths(line)[-1])
        along = _lengths(whole)
        if chest < _SHORT * self._size:
            chest = 0.0
        at = np.linspace(0.0, chest, _SPINE + 1) if chest else np.zeros(1)
        spine = _at(whole, at)
        if not head:
            return spine, np.empty((0, 3))
        beyond = np.linspace(chest, along[-1], max(len(head), 2) + 1)[1:]
        return spine, _at(whole, beyond)

    # Nodes.

    def _limbs(
        self, nodes: _Nodes, lines: Lines, parent: int, segments: Segments
    ) -> dict[Side, Limb]:
        if len(lines) < len(SIDES):
            return {}
        pair = divided(lines[Side.LEFT], lines[Side.RIGHT], self._plane, segments)
        found = {}
        for side, pieces in zip(SIDES, pair, strict=True):
            near = nodes.add(pieces[0][0], parent)
            chains = []
            for piece in pieces:
                chains.append(nodes.chain(near, piece[1:]))
                near = chains[-1][-1]
            found[side] = Limb(*chains)
        return found

    def _skull(self, nodes: _Nodes, head: Chain) -> int | None:
        """The node of the new head that is nearest to where the head turned before."""
        if not head or self._plan.skull is None:
            return None
        old = self._tree.positions[self._plan.skull]
        return _nearest(nodes.places, head[1:-1] or head[1:], old)

    def _hang_rest(self, nodes: _Nodes, chains: Sequence[Chain]) -> None:
        """Hang what belongs to no part, such as fingers and ears, where it hung before."""
        plan = self._plan
        tree = self._tree.rerooted(plan.hips)
        used = {node for chain in plan.in_words().values() for node in chain}
        used |= {node for end in used for node in tree.chain(plan.hips, end)}
        own = tuple(dict.fromkeys(node for chain in chains for node in chain))
        place: dict[int, int] = {}
        for node in tree.order:
            parent = int(tree.parents[node])
            if node in used or parent < 0:
                continue
            if parent in place:
                above = place[parent]
            else:
                above = _nearest(nodes.places, own, tree.positions[parent])
            place[node] = nodes.add(tree.positions[node], above)


def _chains(limbs: Mapping[Side, Limb]) -> list[Chain]:
    return [limb.chain for limb in limbs.values()]


def _nearest(places: Sequence[Array], nodes: Sequence[int], point: Array) -> int:
    gaps = [float(np.linalg.norm(places[node] - point)) for node in nodes]
    return nodes[int(np.argmin(gaps))]


def _lengths(line: Array) -> Array:
    """How far (n,) each point (n, 3) of a line is along it."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))


def _at(line: Array, lengths: Array) -> Array:
    """The points (m, 3) of a line that are so far along it (m,)."""
    along = _lengths(line)
    return np.stack([np.interp(lengths, along, line[:, k]) for k in range(3)], axis=1)


def _place_on(line: Array, point: Array) -> float:
    """How far along a line its point nearest to another one is."""
    dense = np.linspace(0.0, float(_lengths(line)[-1]), 200)
    gaps = np.linalg.norm(_at(line, dense) - point, axis=1)
    return float(dense[int(np.argmin(gaps))])
