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
from runtime.driving.driver import ABSOLUTE, RELATIVE
from solvers.retarget.limb_posing import BLENDS, RIDES, LimbRig, hand_frame
from solvers.retarget.trunk_turns import TrunkJoints
from solvers.skeleton.quaternions import conjugate, multiply
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_UPRIGHT = np.cos(np.radians(35.0))  # of a leg against the vertical; one that leans more is none
_DOWN = np.array([0.0, -1.0, 0.0])
_LOW = 0.15  # of the height: a limb that ends lower stands on the floor
_BESIDE = 0.35  # of the forearm: bones that begin this near to the wrist are parts of the hand
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
    """
    rig = _Rig(tree, upright, facing)
    parts: list[Part] = []
    legs: list[Leg] = []
    arms: list[Arm] = []
    chosen = frozenset(joints)
    for side in SIDES:
        theirs, ours = source.legs.get(side), plan.legs.get(side)
        if theirs and ours and chosen.issuperset(theirs.upper):
            drive, segments = rig.add_leg(theirs, ours)
            parts.append(Part(f"{side} leg", _joined(theirs), _joined(ours), drive))
            if theirs.lower and ours.lower:
                legs.append(Leg(_bends(theirs), _bends(ours), segments))
    for side in SIDES:
        theirs, ours = source.arms.get(side), plan.arms.get(side)
        if theirs and ours and chosen.issuperset(theirs.upper):
            first = rig.segments
            drive = rig.add_arm(theirs, ours, _knuckles(source, side), _knuckles(plan, side))
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
        np.array(rig.hand_change),
        skull,
        tuple(legs),
        tuple(arms),
    )


class _Rig:
    """Collects the segments of a `LimbRig`."""

    def __init__(self, tree: Tree, upright: Array, facing: float) -> None:
        self._tree, self._rest, self._upright = tree, tree.positions, upright
        self._front = np.array([np.sin(facing), 0.0, np.cos(facing)])
        self._role = np.full(len(tree), RIDES)
        self._share = np.zeros(len(tree))
        self._near: list[int] = []
        self._far: list[int] = []
        self._across: list[tuple[int, int]] = []
        self._along: list[Array] = []
        self._frame: list[Array] = []
        self._is_free: list[bool] = []
        self._twisted_by: list[int] = []
        self.hands: list[int] = []
        self.hand_change: list[Array] = []

    @property
    def segments(self) -> int:
        """How many segments there are."""
        return len(self._near)

    def add_leg(self, theirs: Limb, ours: Limb) -> tuple[str, tuple[int, int, int]]:
        """Let a leg follow a leg; return how it is driven, and its segments as of `Leg`."""
        drive = ABSOLUTE
        if any(_leans(self._rest, chain) for chain in (ours.upper, ours.lower) if chain):
            drive = RELATIVE
        last, foot = self._follow(theirs, ours, drive, self._upright), -1
        if ours.end:
            ends = theirs.end or (theirs.lower or theirs.upper)[-1:]
            foot = self._add(ours.end, ends[0], ends[-1])
            self._is_free[foot] = True
            self._along[foot] = _direction(self._upright, ends)
        return drive, (last - 1, last, foot)

    def add_arm(
        self,
        theirs: Limb,
        ours: Limb,
        source_knuckles: tuple[int, int] | None,
        target_knuckles: tuple[int, int] | None,
    ) -> str:
        """Let an arm follow an arm, its hand a hand; return how it is driven."""
        drive = ABSOLUTE
        neutral: Array | None = self._upright
        low = self._rest[:, 1].min() + _LOW * np.ptp(self._rest[:, 1])
        segments = (ours.upper, ours.lower)
        if self._rest[ours.segments[-1][-1], 1] < low and any(
            _leans(self._rest, chain) for chain in segments if chain
        ):
            drive, neutral = RELATIVE, None
        last = self._follow(theirs, ours, drive, neutral)
        if not (ours.end and theirs.end):
            return drive
        hand = self._add(ours.end, theirs.end[0], theirs.end[-1])
        frame = self._hand_at_rest(self._rest, ours.end, target_knuckles)
        if source_knuckles:
            self._across[hand], self._frame[hand] = source_knuckles, frame
        else:
            self.hands[hand] = theirs.end[0]
            theirs_at_rest = self._hand_at_rest(self._upright, theirs.end, None)
            self.hand_change[hand] = multiply(theirs_at_rest, conjugate(frame))
        if ours.lower:
            self._twisted_by[last] = hand
            self._take_beside(ours, hand)
        return drive

    def _hand_at_rest(self, points: Array, hand: Chain, knuckles: tuple[int, int] | None) -> Array:
        """The orientation (4,) of a hand at rest; without knuckles its palm looks down or inward.

        The index finger is then in front, as in a T pose and beside the thighs alike.
        """
        if knuckles is not None:
            return hand_frame(points, hand[0], hand[-1], knuckles)
        behind = points[hand[0]] - self._front
        three = np.array([points[hand[0]], points[hand[-1]], behind])
        return hand_frame(three, 0, 1, (0, 2))

    def add_fingers(self, source: BodyPlan, plan: BodyPlan, side: Side) -> None:
        """Let each finger follow the finger of the same name, bone for bone."""
        for key, ours in plan.fingers.items():
            theirs = source.fingers.get(key)
            if key[0] is not side or theirs is None:
                continue
            bones = min(len(ours), len(theirs)) - 1
            for bone in range(bones):
                last = len(theirs) - 1 if bone == bones - 1 else bone + 1
                self._add(ours[bone : bone + 2], theirs[bone], theirs[last])

    def blend_trunk(self, plan: BodyPlan, has_head: bool) -> None:
        """Bend the trunk between pelvis and chest, and the neck between chest and head."""
        self._blend(plan.trunk, 0.0)
        if len(plan.trunk) == 1:
            self._share[plan.hips] = 0.5
        if has_head and plan.skull is not None:
            neck = plan.head[: plan.head.index(plan.skull) + 1]
            self._blend(neck, 1.0, skip=1 if len(plan.trunk) > 1 or len(neck) > 1 else 0)
            for node in plan.head[len(neck) :]:
                self._role[node] = RIDES

    def finished(self) -> LimbRig:
        """The rig."""
        return LimbRig(
            order=np.array(self._tree.order, dtype=np.int64),
            parents=self._tree.parents,
            rest=self._rest,
            role=self._role.astype(np.int64),
            share=self._share,
            near=np.array(self._near, dtype=np.int64),
            far=np.array(self._far, dtype=np.int64),
            across=np.array(self._across, dtype=np.int64).reshape(-1, 2),
            along=np.array(self._along).reshape(-1, 3),
            frame=np.array(self._frame).reshape(-1, 4),
            is_free=np.array(self._is_free, dtype=np.bool_),
            twisted_by=np.array(self._twisted_by, dtype=np.int64),
        )

    def _follow(self, theirs: Limb, ours: Limb, drive: str, neutral: Array | None) -> int:
        """Let upper and lower segment follow; return the number of the last one."""
        pairs = [(ours.upper, theirs.upper)]
        if not ours.lower and theirs.lower:
            pairs = [(ours.upper, theirs.upper + theirs.lower)]
        elif ours.lower:
            pairs.append((ours.lower, theirs.lower or theirs.upper))
        for mine, source in pairs:
            last = self._add(mine, source[0], source[-1])
            if drive == RELATIVE:
                self._along[last] = _DOWN if neutral is None else _direction(neutral, source)
        return last

    def _add(self, nodes: Chain, near: int, far: int) -> int:
        """Let the bones of a segment follow the line between two joints; return its number."""
        number = len(self._near)
        free = [node for node in nodes[:-1] if self._role[node] == RIDES]
        self._role[free] = number
        self._near.append(near)
        self._far.append(far)
        self._across.append((-1, -1))
        self._along.append(_direction(self._rest, nodes))
        self._frame.append(np.zeros(4))
        self._is_free.append(False)
        self._twisted_by.append(-1)
        self.hands.append(-1)
        self.hand_change.append(np.zeros(4))
        return number

    def _take_beside(self, ours: Limb, hand: int) -> None:
        """Let all bones turn with the hand that begin beside its wrist on the forearm."""
        wrist = ours.end[0]
        reach = _BESIDE * float(np.linalg.norm(self._rest[wrist] - self._rest[ours.lower[0]]))
        for node in self._tree.children[int(self._tree.parents[wrist])]:
            near = float(np.linalg.norm(self._rest[node] - self._rest[wrist])) < reach
            if near and node not in ours.lower and self._role[node] == RIDES:
                self._role[node] = hand

    def _blend(self, chain: Chain, start: float, skip: int = 0) -> None:
        lengths = np.linalg.norm(np.diff(self._rest[list(chain)], axis=0), axis=1)
        along = np.append(0.0, lengths.cumsum())
        shares = along / along[-1] if along[-1] > 0.0 else np.linspace(0.0, 1.0, len(chain))
        for node, share in list(zip(chain, shares, strict=True))[skip:]:
            self._role[node], self._share[node] = BLENDS, start + share


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


def _direction(points: Array, chain: Chain) -> Array:
    """The unit vector (3,) from the first to the last of some points; down without length."""
    gap = points[chain[-1]] - points[chain[0]]
    length = float(np.linalg.norm(gap))
    return gap / length if length > 0.0 else _DOWN


def _leans(points: Array, chain: Chain) -> bool:
    return bool(_direction(points, chain) @ _DOWN < _UPRIGHT)
