"""Which parts of a character correspond to which parts of a performer, by their anatomy."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Chain, Limb
from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import Kind, Side
from devices.skeleton import Skeleton
from runtime.driving.body.rig_builder import RigBuilder
from runtime.driving.driver import ABSOLUTE, RELATIVE
from solvers.retarget.limb_posing import LimbRig
from solvers.retarget.trunk_turns import TrunkJoints
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_WAIST = (0.2, 0.8)  # shares of the trunk between which a joint shows the waist


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the performer that drives the same part of the character.

    Attributes:
        name: in words: "left arm".
        source: joints, from the trunk outward.
        target: nodes, from the trunk outward.
        drive: `ABSOLUTE` if it points where the performer's part points, `RELATIVE` if it turns
            from its rest pose as the performer's turns from standing upright.
    """

    name: str
    source: Chain
    target: Chain
    drive: str


@dataclass(frozen=True, slots=True)
class Leg:
    """A leg of the performer that drives a leg of the character.

    Attributes:
        source: the performer's hip, knee, ankle and toes; without toes the ankle twice.
        target: the character's.
        segments: numbers of thigh, shin and foot; -1 for a foot that is not driven.
    """

    source: tuple[int, int, int, int]
    target: tuple[int, int, int, int]
    segments: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm of the character that points where the performer's points.

    Attributes:
        target: nodes, from the shoulder outward.
        segments: numbers of its segments.
        starts: the node at which each begins.
    """

    target: Chain
    segments: tuple[int, ...]
    starts: tuple[int, ...]


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
        arms: the arms that are driven absolutely.
    """

    parts: tuple[Part, ...]
    rig: LimbRig
    trunk: TrunkJoints
    hands: NDArray[np.int64]
    hand_change: Array
    skull: int
    legs: tuple[Leg, ...]
    arms: tuple[Arm, ...]


def body_parts(
    performer: Skeleton,
    joints: Collection[int],
    upright: Array,
    tree: Tree,
    plan: BodyPlan,
    source: BodyPlan,
    facing: float,
    least_upright: float,
) -> BodyParts | None:
    """Return the parts that both bodies have; None where no limb and no head corresponds.

    Args:
        performer: the performer's skeleton.
        joints: those of its joints that may drive.
        upright: (J, 3) [m] the performer standing upright, turned as the character faces.
        tree: the character's nodes at rest, rooted at its hips.
        plan: the character's body.
        source: the performer's body.
        facing: [rad] the heading of both.
        least_upright: as of `RigBuilder.drive_of`.
    """
    rig = RigBuilder(tree, upright, facing)
    parts: list[Part] = []
    legs: list[Leg] = []
    arms: list[Arm] = []
    chosen = frozenset(joints)
    for side in SIDES:
        theirs, ours = source.legs.get(side), plan.legs.get(side)
        if theirs and ours and chosen.issuperset((theirs.upper[0], theirs.upper[-1])):
            drive = rig.drive_of(plan.legs.values(), least_upright)
            segments = rig.add_leg(theirs, ours, drive)
            parts.append(Part(f"{side} leg", _joined(theirs), _joined(ours), drive))
            if theirs.lower and ours.lower:
                legs.append(Leg(_bends(theirs), _bends(ours), segments))
    for side in SIDES:
        theirs, ours = source.arms.get(side), plan.arms.get(side)
        if theirs and ours and chosen.issuperset((theirs.upper[0], theirs.upper[-1])):
            first = rig.segments
            drive = rig.drive_of(plan.arms.values(), least_upright)
            palms = _knuckles(source, side), _knuckles(plan, side)
            rig.add_arm(theirs, ours, *palms, drive)
            parts.append(Part(f"{side} arm", _joined(theirs), _joined(ours), drive))
            if drive == ABSOLUTE:
                numbers = tuple(range(first, rig.segments))
                starts = tuple(chain[0] for chain in ours.segments[: len(numbers)])
                arms.append(Arm(_joined(ours), numbers, starts))
            rig.add_fingers(source, plan, side)
    has_head = bool(source.head and plan.head) and not chosen.isdisjoint(source.head[1:])
    if not parts and not has_head:
        return None
    if len(plan.trunk) > 1 and len(source.trunk) > 1 and not chosen.isdisjoint(source.trunk[1:]):
        parts.append(Part("trunk", source.trunk, plan.trunk, RELATIVE))
    rig.blend_trunk(plan, has_head)
    if has_head:
        parts.append(Part("head", source.head, plan.head, RELATIVE))
    skull = source.skull if has_head and source.skull is not None else -1
    return BodyParts(
        tuple(parts),
        rig.finished(),
        _trunk_joints(performer, source, chosen),
        np.array(rig.hands, dtype=np.int64),
        np.array(rig.hand_change).reshape(-1, 4),
        skull,
        tuple(legs),
        tuple(arms),
    )


def _trunk_joints(performer: Skeleton, source: BodyPlan, chosen: frozenset[int]) -> TrunkJoints:
    """The joints that show how the performer's trunk and head are turned."""
    hips = _pair(source.legs)
    shoulders = _pair(source.arms)
    seen = source.head[1:] if source.skull is not None else ()
    seen = () if chosen.isdisjoint(seen) else seen
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


def _joined(limb: Limb) -> Chain:
    """All joints of a limb, from the trunk outward."""
    chain = list(limb.upper)
    for segment in (limb.lower, limb.end):
        chain.extend(segment[1:])
    return tuple(chain)


def _bends(limb: Limb) -> tuple[int, int, int, int]:
    """Hip, knee, ankle and toes; without toes the ankle twice."""
    ankle = limb.lower[-1]
    return limb.upper[0], limb.lower[0], ankle, limb.end[-1] if limb.end else ankle
