"""Which parts of a character correspond to which parts of a performer, by their anatomy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Chain, Limb
from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import Kind, Side
from devices.bodies.plan_by_names import plan_by_names
from devices.bodies.rest_heading import rest_heading
from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.driving.body.rig_builder import RigBuilder
from runtime.driving.driver import ABSOLUTE, RELATIVE, DrivenPart
from runtime.driving.pairing import Pairing
from runtime.driving.part_names import part_name
from solvers.retarget.heading import turned
from solvers.retarget.limb_posing import LimbRig
from solvers.retarget.trunk_turns import TrunkJoints
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_WAIST = (0.2, 0.8)  # shares of the trunk between which a joint shows the waist


@dataclass(frozen=True, slots=True)
class Leg:
    """A leg of the performer that drives a leg of the character.

    Attributes:
        source: the performer's hip, knee, ankle and toes; without toes the ankle twice.
        target: the character's.
        segments: numbers of thigh, shin and foot; -1 for a foot that is not driven.
        is_bent: whether it bends at rest and turns from there.
    """

    source: tuple[int, int, int, int]
    target: tuple[int, int, int, int]
    segments: tuple[int, int, int]
    is_bent: bool


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm of the character that follows the performer's.

    Attributes:
        side: of the body.
        target: nodes, from the shoulder outward.
        segments: numbers of its segments.
        starts: the node at which each begins.
        wrist: the node at the end of the forearm.
    """

    side: Side
    target: Chain
    segments: tuple[int, ...]
    starts: tuple[int, ...]
    wrist: int


@dataclass(frozen=True, slots=True)
class Step:
    """A leg of a body of many legs: its foot goes where a foot of the performer goes.

    Attributes:
        side: of the body.
        target: hip, knee and foot of the character.
        segments: numbers of the upper and the lower segment.
        in_turn: whether it steps when the performer's leg of the other side does.
        by_arm: whether it follows the performer's arm when this is lifted.
    """

    side: Side
    target: tuple[int, int, int]
    segments: tuple[int, int]
    in_turn: bool
    by_arm: bool


@dataclass(frozen=True, slots=True, eq=False)
class BodyParts:
    """The corresponding parts of a performer and a character, ready to be posed.

    Attributes:
        parts: in words, from the trunk outward.
        rig: the character's nodes and what turns them.
        trunk: the performer's joints that show how the trunk is turned.
        hands: (S,) for each segment of a hand the performer's joint that turns it, -1 for none.
        hand_change: (S, 4) from the character's hand at rest to the performer's at rest.
        skull: the performer's joint that turns the head; -1 for none.
        legs: the legs of both.
        arms: the arms.
        steps: the legs of a body of many legs.
    """

    parts: tuple[DrivenPart, ...]
    rig: LimbRig
    trunk: TrunkJoints
    hands: NDArray[np.int64]
    hand_change: Array
    skull: int
    legs: tuple[Leg, ...]
    arms: tuple[Arm, ...]
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class TwoBodies:
    """A performer and a character, side by side and turned alike.

    Attributes:
        performer: the performer's skeleton.
        source: the performer's body.
        joints: the performer's joints that may drive.
        upright: (J, 3) [m] the performer standing upright, turned as the character faces.
        character: the character's skeleton.
        plan: the character's body.
        tree: the character's nodes at rest, rooted at its hips.
        facing: [rad] the heading of both.
    """

    performer: Skeleton
    source: BodyPlan
    joints: frozenset[int]
    upright: Array
    character: Skeleton
    plan: BodyPlan
    tree: Tree
    facing: float

    @property
    def left(self) -> Array:
        """(3,) unit, the left of both while they stand upright."""
        return np.array([np.cos(self.facing), 0.0, -np.sin(self.facing)])

    @property
    def front(self) -> Array:
        """(3,) unit, where both look while they stand upright."""
        return np.array([np.sin(self.facing), 0.0, np.cos(self.facing)])

    def part(self, source: Chain, target: Chain, drive: str) -> DrivenPart:
        """A chain of joints that drives a chain of nodes, in words."""
        name = part_name(self.performer, self.source, source)
        target_name = part_name(self.character, self.plan, target)
        return DrivenPart(name, target_name, source, target, drive)

    def pairs(
        self, theirs: Mapping[Side, Limb], ours: Mapping[Side, Limb]
    ) -> Iterator[tuple[Side, Limb, Limb]]:
        """The limbs of both that correspond, where the performer's may drive."""
        for side in SIDES:
            if side in theirs and side in ours:
                upper = theirs[side].upper
                if self.joints.issuperset((upper[0], upper[-1])):
                    yield side, theirs[side], ours[side]

    @property
    def trunk_drives(self) -> bool:
        """Whether the performer's trunk may drive."""
        return not self.joints.isdisjoint(self.source.trunk[1:])

    @property
    def head_drives(self) -> bool:
        """Whether the performer's head may drive the character's."""
        both = self.source.head and self.plan.head
        return bool(both) and not self.joints.isdisjoint(self.source.head[1:])


def two_bodies(pairing: Pairing) -> tuple[TwoBodies, float]:
    """Return performer and character side by side, and the performer's heading [rad] at rest.

    Raises:
        InputError: one of them has no limbs that are known.
    """
    performer, character = pairing.performer, pairing.character
    plan, source = character.plan, plan_by_names(performer)
    if plan is None or source is None:
        who = character.name if plan is None else "the performer"
        raise InputError(f"{who} has no limbs that are known: use --drive relative")
    facing = rest_heading(character.skeleton, plan)
    heading_at_rest = rest_heading(performer, source)
    bodies = TwoBodies(
        performer=performer,
        source=source,
        joints=frozenset(pairing.joints),
        upright=turned(performer.rest_positions, facing - heading_at_rest, np.zeros(3)),
        character=character.skeleton,
        plan=plan,
        tree=pairing.skeleton.tree.rerooted(plan.hips),
        facing=facing,
    )
    return bodies, heading_at_rest


def body_parts(bodies: TwoBodies, least_upright: float) -> BodyParts | None:
    """Return the parts that both bodies have; None where no limb and no head corresponds.

    Args:
        bodies: the performer and the character.
        least_upright: as of `RigBuilder.drive_of`.
    """
    source, plan = bodies.source, bodies.plan
    rig = RigBuilder(bodies.tree, bodies.upright, bodies.facing)
    limbs = _stepping(bodies, rig) if plan.more_legs else _pointing(bodies, rig, least_upright)
    parts = limbs.parts
    if not parts and not bodies.head_drives:
        return None
    if len(plan.trunk) > 1 and bodies.trunk_drives:
        parts.append(bodies.part(source.trunk, plan.trunk, RELATIVE))
    rig.blend_trunk(plan, bodies.head_drives)
    if bodies.head_drives:
        parts.append(bodies.part(source.head, plan.head, RELATIVE))
    skull = source.skull if bodies.head_drives and source.skull is not None else -1
    return BodyParts(
        tuple(parts),
        rig.finished(),
        _trunk_joints(bodies, both_legs=len(limbs.legs) == len(SIDES)),
        np.array(rig.hands, dtype=np.int64),
        np.array(rig.hand_change).reshape(-1, 4),
        skull,
        tuple(limbs.legs),
        tuple(limbs.arms),
        tuple(limbs.steps),
    )


@dataclass(frozen=True, slots=True)
class _Limbs:
    """The limbs that follow, and what they are called: see `BodyParts`."""

    parts: list[DrivenPart] = field(default_factory=list)
    legs: list[Leg] = field(default_factory=list)
    arms: list[Arm] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)


def _pointing(bodies: TwoBodies, rig: RigBuilder, least_upright: float) -> _Limbs:
    """Let legs follow legs and arms follow arms, bone for bone."""
    source, plan, limbs = bodies.source, bodies.plan, _Limbs()
    drive = rig.drive_of(plan.legs.values(), least_upright)
    for _, theirs, ours in bodies.pairs(source.legs, plan.legs):
        segments = rig.add_leg(theirs, ours, drive)
        limbs.parts.append(bodies.part(theirs.chain, ours.chain, drive))
        if theirs.lower and ours.lower:
            limbs.legs.append(Leg(_bends(theirs), _bends(ours), segments, drive == RELATIVE))
    if plan.arm_word == "wing":
        limbs.arms.extend(_wings(bodies, rig, limbs.parts))
        return limbs
    drive = rig.drive_of(plan.arms.values(), least_upright)
    for side, theirs, ours in bodies.pairs(source.arms, plan.arms):
        palms = _knuckles(source, side), _knuckles(plan, side)
        numbers = rig.add_arm(theirs, ours, *palms, drive)
        limbs.parts.append(bodies.part(theirs.chain, ours.chain, drive))
        starts = tuple(chain[0] for chain in ours.segments[: len(numbers)])
        wrist = (ours.lower or ours.upper)[-1]
        limbs.arms.append(Arm(side, ours.chain, numbers, starts, wrist))
        rig.add_fingers(source, plan, side)
    return limbs


def _wings(bodies: TwoBodies, rig: RigBuilder, parts: list[DrivenPart]) -> Iterator[Arm]:
    """Let wings follow arms, bone for bone of their own."""
    for side, theirs, ours in bodies.pairs(bodies.source.arms, bodies.plan.arms):
        parts.append(bodies.part(theirs.chain, ours.chain, ABSOLUTE))
        wrist = (ours.lower or ours.upper)[-1]
        yield Arm(side, ours.chain, rig.add_wing(theirs, ours), ours.chain[:-1], wrist)


def _stepping(bodies: TwoBodies, rig: RigBuilder) -> _Limbs:
    """Let the feet of many legs go where the performer's feet, and hands, go."""
    source, plan, limbs = bodies.source, bodies.plan, _Limbs()
    pairs = (plan.legs, *reversed(plan.more_legs), plan.arms)
    for number, pair in enumerate(pairs):
        by_arm = pair is plan.arms
        theirs = source.arms if by_arm else source.legs
        for side, limb, ours in bodies.pairs(theirs, pair):
            if not ours.lower:
                continue
            segments = rig.add_step(limb, ours)
            limbs.parts.append(bodies.part(limb.chain, ours.chain, RELATIVE))
            target = ours.upper[0], ours.lower[0], ours.lower[-1]
            limbs.steps.append(Step(side, target, segments, number % 2 == 1, by_arm))
            if pair is plan.legs and limb.lower:
                limbs.legs.append(Leg(_bends(limb), _bends(ours), (*segments, -1), is_bent=False))
    return limbs


def _trunk_joints(bodies: TwoBodies, *, both_legs: bool) -> TrunkJoints:
    """The joints that show how the performer's trunk and head are turned.

    Who lends one arm only lends no trunk: then none of its joints shows anything.
    """
    performer, source, nothing = bodies.performer, bodies.source, np.full(2, -1)
    hips = _pair(source.legs) if bodies.trunk_drives or both_legs else nothing
    shoulders = _pair(source.arms) if bodies.trunk_drives else nothing
    seen = source.head[1:] if bodies.head_drives and source.skull is not None else ()
    return TrunkJoints(
        hips=hips,
        shoulders=shoulders,
        waist=_waist(performer, source),
        neck=source.trunk[-1] if len(source.trunk) > 1 else -1,
        head=seen[-1] if seen else -1,
        face=_face(performer) if seen else np.full(3, -1),
    )


def _pair(limbs: Mapping[Side, Limb]) -> NDArray[np.int64]:
    both = [limbs[side].upper[0] for side in SIDES if side in limbs]
    return np.array(both if len(both) == len(SIDES) else [-1, -1], dtype=np.int64)


def _waist(performer: Skeleton, source: BodyPlan) -> int:
    """The joint of the spine that is nearest to its middle; -1 where none is near."""
    rest = performer.rest_positions[list(source.trunk)]
    along = np.append(0.0, np.linalg.norm(np.diff(rest, axis=0), axis=1).cumsum())
    if len(along) < 3 or along[-1] <= 0.0:
        return -1
    shares = along / along[-1]
    best = int(np.argmin(np.abs(shares - 0.5)))
    return source.trunk[best] if _WAIST[0] < shares[best] < _WAIST[1] else -1


def _face(performer: Skeleton) -> NDArray[np.int64]:
    """The two ears or eyes and the nose; -1 where they are not all there."""
    found: dict[tuple[str, Side], int] = {}
    for joint, part in enumerate(label_joints(performer)):
        if part is not None and not part.tip:
            found.setdefault((part.word, part.side), joint)
    nose = found.get(("nose", Side.CENTRE))
    for word in ("ear", "eye"):
        left, right = found.get((word, Side.LEFT)), found.get((word, Side.RIGHT))
        if left is not None and right is not None and nose is not None:
            return np.array([left, right, nose], dtype=np.int64)
    return np.full(3, -1)


def _knuckles(plan: BodyPlan, side: Side) -> tuple[int, int] | None:
    """The knuckles on both sides of a palm: of the index finger and of the outermost one."""
    first = plan.fingers.get((side, Kind.INDEX))
    for kind in (Kind.LITTLE, Kind.RING, Kind.MIDDLE):
        last = plan.fingers.get((side, kind))
        if first and last:
            return first[0], last[0]
    return None


def _bends(limb: Limb) -> tuple[int, int, int, int]:
    """Hip, knee, ankle and toes; without toes the ankle twice."""
    ankle = limb.lower[-1]
    return limb.upper[0], limb.lower[0], ankle, limb.end[-1] if limb.end else ankle
