"""The plan of a body: its trunk, head, arms, legs and fingers as chains of joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import FINGERS, BodyPart, Kind, Side
from devices.skeleton import Skeleton

SIDES = (Side.LEFT, Side.RIGHT)
_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
_LEG = (Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT, Kind.TOES)
_SHORT = 1e-3  # of the skeleton's size: joints this close have no direction between them

Chain = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Limb:
    """An arm or a leg: its segments from the trunk outward, each a chain of joints.

    Each segment begins where the one before it ends, and is straight: it bends at its ends only.

    Attributes:
        upper: from the shoulder to the elbow, or from the hip to the knee.
        lower: from the elbow to the wrist, or from the knee to the ankle; empty where the limb has
            no such joint.
        end: the hand to its tip, or the foot to its ball; empty where nothing is beyond.
    """

    upper: Chain
    lower: Chain = ()
    end: Chain = ()

    @property
    def segments(self) -> tuple[Chain, ...]:
        """The segments that are there, from the trunk outward."""
        return tuple(chain for chain in (self.upper, self.lower, self.end) if chain)


@dataclass(frozen=True, slots=True)
class BodyPlan:
    """The parts of a body that other bodies have too; a part may be missing.

    The left is the body's own left. Joints that belong to no part ride on the joint that they hang
    on.

    Attributes:
        trunk: from the hips to the joint that carries neck and arms; the hips alone if the body
            has no spine.
        head: from the end of the trunk, or above it, along the neck to the top of the head; empty
            for none.
        skull: the joint about which the head turns; None where `head` is empty.
        arms, legs: by side. Wings, fins and forelegs are arms.
        fingers: by side and kind, each from its knuckle to its tip.
        tail: from the trunk to its tip; empty for none.
    """

    trunk: Chain
    head: Chain = ()
    skull: int | None = None
    arms: Mapping[Side, Limb] = field(default_factory=dict)
    legs: Mapping[Side, Limb] = field(default_factory=dict)
    fingers: Mapping[tuple[Side, Kind], Chain] = field(default_factory=dict)
    tail: Chain = ()

    @property
    def hips(self) -> int:
        """The joint that carries the body."""
        return self.trunk[0]

    @property
    def is_body(self) -> bool:
        """Whether the parts are enough to drive a body by: a pair of limbs on a trunk."""
        return len(self.arms) == len(SIDES) or len(self.legs) == len(SIDES)


def plan_by_names(skeleton: Skeleton) -> BodyPlan | None:
    """Return the plan of a body whose joints have known names or a known shape.

    Returns:
        None where neither both arms nor both legs are known.
    """
    labels = _Labels(skeleton)
    arms = {side: limb for side in SIDES if (limb := labels.limb(_ARM, side)) is not None}
    legs = {side: limb for side in SIDES if (limb := labels.limb(_LEG, side)) is not None}
    trunk = labels.trunk([limb.upper[0] for limb in (*arms.values(), *legs.values())], legs)
    head = labels.head(trunk)
    plan = BodyPlan(
        trunk=trunk,
        head=head,
        skull=labels.skull(head),
        arms=arms,
        legs=legs,
        fingers=dict(labels.fingers()),
        tail=labels.tail(),
    )
    return plan if plan.is_body else None


class _Labels:
    """The labels of a skeleton's joints, and the parts that they make up."""

    def __init__(self, skeleton: Skeleton) -> None:
        self._skeleton = skeleton
        self._parts: Sequence[BodyPart | None] = label_joints(skeleton)
        self._least = _SHORT * float(np.ptp(skeleton.rest_positions, axis=0).max(initial=1e-9))

    def limb(self, kinds: Sequence[Kind], side: Side) -> Limb | None:
        """The limb whose parts are called so; None where its beginning is not known."""
        starts = [self._first(kind, side) for kind in kinds]
        upper = starts[0]
        if upper is None:
            return None
        known = [joint for joint in starts[1:3] if joint is not None and self._below(upper, joint)]
        marks = [upper, *known]
        segments = [self._chain(near, far) for near, far in pairwise(marks)]
        segments = [segment for segment in segments if segment]
        end = self._end(marks[-1], kinds, side)
        if end:
            segments.append(end)
        return Limb(*segments[:3]) if segments else None

    def trunk(self, limbs: Sequence[int], legs: Mapping[Side, Limb]) -> Chain:
        """From the hips to the nearest joint that all limbs above the hips hang on."""
        tree, hips = self._skeleton.tree, self._first(Kind.HIPS, Side.CENTRE)
        if hips is None:
            hips = self._skeleton.root
        low = {limb.upper[0] for limb in legs.values()}
        carriers = [joint for joint in limbs if joint not in low]
        head = self._first(Kind.NECK, Side.CENTRE) or self._first(Kind.HEAD, Side.CENTRE)
        if head is not None:
            carriers.append(head)
        chest = hips
        if carriers:
            paths = [tree.chain(hips, joint)[:-1] for joint in carriers]
            shared = [nodes for nodes in zip(*paths, strict=False) if len(set(nodes)) == 1]
            chest = shared[-1][0] if shared else hips
        return tree.chain(hips, chest)

    def head(self, trunk: Chain) -> Chain:
        """From the end of the trunk to the top of the head."""
        tree = self._skeleton.tree
        head = self._first(Kind.HEAD, Side.CENTRE)
        if head is None:
            return ()
        tops = [j for j in tree.subtree(head) if (p := self._parts[j]) and p.kind is Kind.HEAD]
        return tree.chain(trunk[-1], tops[-1])

    def skull(self, head: Chain) -> int | None:
        """The first joint of the head in a chain along the neck."""
        for joint in head:
            part = self._parts[joint]
            if part is not None and part.kind is Kind.HEAD:
                return joint
        return None

    def fingers(self) -> Iterator[tuple[tuple[Side, Kind], Chain]]:
        """Each finger from its knuckle to its tip."""
        tree = self._skeleton.tree
        for side in SIDES:
            for kind in FINGERS[:-1]:
                knuckle = self._first(kind, side)
                if knuckle is None:
                    continue
                own = [j for j in tree.subtree(knuckle) if (p := self._parts[j]) and p.kind is kind]
                chain = tree.chain(knuckle, own[-1])
                if len(chain) > 1:
                    yield (side, kind), chain

    def tail(self) -> Chain:
        """From the joint that the tail hangs on to its tip."""
        tree, first = self._skeleton.tree, self._first(Kind.TAIL, Side.CENTRE)
        if first is None:
            return ()
        own = [j for j in tree.subtree(first) if (p := self._parts[j]) and p.kind is Kind.TAIL]
        parent = int(tree.parents[first])
        return tree.chain(parent if parent >= 0 else first, own[-1])

    def _first(self, kind: Kind, side: Side) -> int | None:
        return first_of(self._parts, self._skeleton, kind, side)

    def _below(self, upper: int, joint: int) -> bool:
        return upper in self._skeleton.tree.chain(self._skeleton.root, joint)

    def _chain(self, near: int, far: int) -> Chain:
        """The joints from one to another; empty where they stand at one place."""
        rest = self._skeleton.rest_positions
        if near == far or np.linalg.norm(rest[far] - rest[near]) < self._least:
            return ()
        return self._skeleton.tree.chain(near, far)

    def _end(self, joint: int, kinds: Sequence[Kind], side: Side) -> Chain:
        """From the last known joint of a limb to the end of hand or foot; empty for none."""
        ranks = (Kind.MIDDLE, Kind.INDEX, Kind.FINGER, Kind.HAND) if kinds is _ARM else kinds[:1:-1]
        for kind in ranks:
            for other in self._skeleton.tree.subtree(joint)[1:]:
                part = self._parts[other]
                if part is not None and part.kind is kind and part.side is side:
                    chain = self._chain(joint, other)
                    if chain:
                        return chain
        return ()
