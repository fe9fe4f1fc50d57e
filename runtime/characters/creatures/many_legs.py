"""The plan of a body that stands on more than four legs: a spider, an insect, a crab."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Chain, Limb
from devices.bodies.joint_names import Side
from devices.bodies.limb_segments import bend_between, neck_and_head
from runtime.characters.body_shape import UP, BodyShape
from solvers.skeleton.limbs import bones_in_trunk, surface_points
from solvers.skeleton.mirror_pairs import LimbPair, MirroredTree, mirrored_tree
from solvers.skeleton.mirror_plane import MirrorPlane
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_FEWEST = 3  # pairs
_ASYMMETRIC = 0.03  # a plane with more asymmetry divides no body
_LIKE = 0.4  # of the longest leg: a shorter limb is a feeler, a jaw or a claw
_BESIDE = 0.01  # of the size: a leg begins farther from the plane
_LEAST = 0.05  # of the size: a shorter tail or head is none

# What points forward.
_FEELERS = 2.0  # weight of feelers, jaws and claws ahead of the legs
_DOUBT = 0.01


def plan_of_many_legs(
    vertices: Array, faces: NDArray[np.int64], tree: Tree, planes: Sequence[MirrorPlane]
) -> BodyPlan | None:
    """Return the plan of a body with three pairs of legs or more; None for any other.

    The front pair are its arms. Feelers, jaws and claws lead forward, and the bulk of the body lies
    behind the legs.

    Args:
        vertices: (N, 3) [m] surface at rest, +Y up.
        faces: (F, 3) into `vertices`.
        tree: the skeleton's nodes at rest [m].
        planes: mirror planes of the surface, the best first.
    """
    points = surface_points(vertices, faces)
    for plane in planes:
        if plane.asymmetry > _ASYMMETRIC:
            continue
        halves = mirrored_tree(tree, plane, float(np.ptp(points, axis=0).max()))
        body = _ManyLegs(tree, halves, points)
        if len(body.legs) >= _FEWEST:
            return body.plan(bones_in_trunk(vertices, faces, tree.parents, tree.positions))
    return None


class _ManyLegs:
    """A body that a mirror plane divides, and its pairs of legs."""

    def __init__(self, tree: Tree, halves: MirroredTree, points: Array) -> None:
        shape = BodyShape(tree, halves, points)
        self._tree, self._halves, self._size = tree, halves, shape.size
        self._away = np.abs(halves.plane.distance(tree.positions)) / shape.size
        standing = shape.standing() if halves.middle else []
        long = max((shape.length(pair) for pair in standing), default=0.0)
        self.legs = [pair for pair in standing if shape.length(pair) >= _LIKE * long]
        self._times = Counter(
            node for pair in self.legs for chain in pair.chains for node in set(chain)
        )
        if self.legs:
            self._forward = self._front(points)
            self.legs.sort(key=lambda pair: -float(self._middle(pair) @ self._forward))

    def plan(self, inside: NDArray[np.bool_]) -> BodyPlan:
        """The plan.

        Args:
            inside: (K,) whether the bone that ends at a node lies inside the trunk.
        """
        front, *between, hind = self.legs
        trunk = self._tree.chain(hind.root, front.root)
        head = self._longest(front.root, 1.0, trunk)
        pieces = neck_and_head(head, self._tree.positions)
        return BodyPlan(
            trunk=trunk,
            head=head,
            skull=(pieces[-1][0] if len(pieces) > 1 else head[0]) if head else None,
            arms=self._limbs(front, inside),
            legs=self._limbs(hind, inside),
            more_legs=tuple(self._limbs(pair, inside) for pair in between),
            tail=self._longest(hind.root, -1.0, (*trunk, *head)),
            arm_word="front leg",
            leg_word="hind leg",
        )

    def _front(self, points: Array) -> Array:
        """The direction (3,) in which the body looks, horizontal, in the mirror plane."""
        along = np.cross(self._halves.plane.normal, UP)
        middle = np.mean([self._middle(pair) for pair in self.legs], axis=0) @ along
        sign = float(middle - points.mean(axis=0) @ along) / self._size
        for pair in self._halves.pairs:
            if pair not in self.legs:
                sign += _FEELERS * float(self._middle(pair) @ along - middle) / self._size
        if abs(sign) < _DOUBT:  # as most files have it; with a tie broken the same way always
            sign = float(along @ [0.1, 0.0, 1.0])
        forward: Array = along * np.sign(sign)
        return forward

    def _middle(self, pair: LimbPair) -> Array:
        """The point (3,) between the tips of a pair."""
        middle: Array = self._tree.positions[[chain[-1] for chain in pair.chains]].mean(axis=0)
        return middle

    def _longest(self, start: int, way: float, taken: Chain) -> Chain:
        """The longest branch of the middle line from `start` that leads ahead or, -1, behind."""
        longest: Chain = ()
        for end in self._halves.ends:
            chain = self._tree.chain(start, end)
            ahead = (self._tree.positions[end] - self._tree.positions[start]) @ self._forward
            length = self._tree.length(chain)
            free = set(chain[1:]).isdisjoint(taken)
            if free and way * ahead > 0.0 and length > _LEAST * self._size:
                longest = max(longest, chain, key=self._tree.length)
        return longest

    def _limbs(self, pair: LimbPair, inside: NDArray[np.bool_]) -> Mapping[Side, Limb]:
        """The limbs of a pair by the body's own sides, each divided at its knee."""
        sides = SIDES
        if self._halves.plane.normal @ np.cross(UP, self._forward) < 0.0:
            sides = sides[::-1]
        return {
            side: Limb(*bend_between(self._outside(chain, inside), self._tree.positions))
            for side, chain in zip(sides, pair.chains, strict=True)
        }

    def _outside(self, chain: Chain, inside: NDArray[np.bool_]) -> Chain:
        """The part of a limb that lies beside the trunk and is its own, of two nodes at least."""
        start = 0
        while start + 2 < len(chain) and (
            self._away[chain[start]] < _BESIDE
            or self._times[chain[start]] > 1
            or inside[chain[start + 1]]
        ):
            start += 1
        return chain[start:]
