"""Find the plan of a body by the names of its joints."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from devices.bodies.body_plan import SIDES, BodyPlan, Chain, Limb
from devices.bodies.hand_plan import body_of_hands
from devices.bodies.joint_labels import first_of, label_joints
from devices.bodies.joint_names import FINGERS, BodyPart, Kind, LimbName, Side, part_of_name
from devices.bodies.limb_segments import arm_segments, bend_between, leg_segments, neck_and_head
from devices.skeleton import Skeleton

_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
_LEG = (Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT, Kind.TOES)
_WINGS = ((Kind.WING,), (Kind.FIN,))
_SPINE = (Kind.SPINE, Kind.CHEST)
_FEWEST_BONES = 6  # three of each of two limbs
_SHORT = 1e-3  # of the skeleton's size: joints this close have no direction between them
_AS_LONG = 0.5  # of a leg: another one on the same side that is longer is one of a spider's


def plan_by_names(skeleton: Skeleton) -> BodyPlan | None:
    """Return the plan of a body whose joints have known names or a known shape.

    Wings and fins are arms where there are no others. Limbs whose joints are all named alike are
    divided by their shape (`devices.bodies.limb_segments`). Two hands without a body are its arms.

    Returns:
        None where neither both arms nor both legs are known, for a body with more than two pairs of
        legs, and for a hand or an arm alone.
    """
    labels = _Labels(skeleton)
    root = labels.parts[skeleton.root]
    if labels.has_many_legs():
        return None
    if root is not None and root.kind in (*_ARM, *FINGERS):
        return body_of_hands(skeleton)
    arms, arm_word = labels.arms()
    legs = labels.limbs(_LEG)
    trunk = labels.trunk(arms, legs)
    head, skull = labels.head(trunk)
    plan = BodyPlan(
        trunk=trunk,
        head=head,
        skull=skull,
        arms=arms,
        legs=legs,
        fingers=dict(labels.fingers()),
        tail=labels.tail(trunk, head),
        arm_word=arm_word,
        leg_word="hind leg" if arm_word == "foreleg" else "leg",
    )
    return plan if plan.is_body and _apart(plan) else None


def plan_by_declaration(skeleton: Skeleton, bones: Mapping[str, int]) -> BodyPlan | None:
    """Return the plan of a body whose file says which of its joints are a humanoid's bones.

    The joints' own names tell only what no humanoid has, a tail, and where bones end.

    Args:
        skeleton: the body.
        bones: joints by the names of a humanoid's bones, as VRM has them: "leftUpperArm".

    Returns:
        None where the bones are not enough for a plan.
    """
    if len(bones) < _FEWEST_BONES:
        return None
    words = {joint: bone for bone, joint in reversed([*bones.items()]) if bone.isalpha()}
    names = [
        f"{name}.{joint}" if (part := part_of_name(name)) and _beyond(part) else f"#{joint}"
        for joint, name in enumerate(skeleton.names)
    ]
    for joint, bone in words.items():
        names[joint] = bone
    return plan_by_names(Skeleton(tuple(names), skeleton.parents, skeleton.rest_positions))


def _beyond(part: BodyPart) -> bool:
    return part.tip or part.kind is Kind.TAIL


def _apart(plan: BodyPlan) -> bool:
    """Whether trunk, head, tail and limbs share no bone; names may contradict the tree."""
    limbs = (limb.chain for limb in (*plan.arms.values(), *plan.legs.values()))
    bones = [
        frozenset(bone)
        for part in (plan.trunk, plan.head, plan.tail, *limbs)
        for bone in pairwise(part)
    ]
    return len(set(bones)) == len(bones)


class _Labels:
    """The labels of a skeleton's joints, and the parts that they make up."""

    def __init__(self, skeleton: Skeleton) -> None:
        self._skeleton = skeleton
        self._tree = skeleton.tree
        self.parts: Sequence[BodyPart | None] = label_joints(skeleton)
        self._least = _SHORT * float(np.ptp(skeleton.rest_positions, axis=0).max(initial=1e-9))

    def arms(self) -> tuple[dict[Side, Limb], str]:
        """Arms, forelegs, wings or fins, the first that there are, and what they are called."""
        found: dict[Side, Limb] = {}
        for kinds in (_ARM, *_WINGS):
            found = self.limbs(kinds)
            if found:
                break
        names = {
            part.limb for limb in found.values() if (part := self.parts[limb.upper[0]]) is not None
        }
        name = names.pop() if len(names) == 1 else LimbName.PLAIN
        return found, name.value or "arm"

    def limbs(self, kinds: Sequence[Kind]) -> dict[Side, Limb]:
        """The limbs of both sides whose parts are called so."""
        return {side: limb for side in SIDES if (limb := self._limb(kinds, side)) is not None}

    def has_many_legs(self) -> bool:
        """Whether one side has several legs that begin beside each other."""
        for side in SIDES:
            own = set(self._own(_LEG[:2], side, self._tree.order))
            tops = [joint for joint in own if own.isdisjoint(self._above(joint))]
            lengths = sorted(float(self._tree.heights[top]) for top in tops)
            if len(lengths) > 1 and lengths[-2] > _AS_LONG * lengths[-1]:
                return True
        return False

    def trunk(self, arms: Mapping[Side, Limb], legs: Mapping[Side, Limb]) -> Chain:
        """From the hips to the nearest joint that all limbs above the hips hang on."""
        hips = self._hips(legs)
        carried = [limb.upper[0] for limb in arms.values()]
        carried += [
            joint
            for kind in (Kind.NECK, Kind.HEAD)
            if (joint := self._first(kind, Side.CENTRE)) is not None
        ][:1]
        if not carried:
            return self._onward(hips, lambda part: part is not None and part.kind in _SPINE)
        paths = [self._tree.chain(hips, joint)[:-1] for joint in carried]
        shared = [nodes for nodes in zip(*paths, strict=False) if len(set(nodes)) == 1]
        return self._tree.chain(hips, shared[-1][0] if shared else hips)

    def head(self, trunk: Chain) -> tuple[Chain, int | None]:
        """From the end of the trunk to the top of the head, and the joint that it turns about.

        A body without a joint called head has the rest of its spine for a neck and head, or what
        else its trunk carries in the middle.
        """
        first = self._first(Kind.HEAD, Side.CENTRE)
        if first is not None:
            chain = self._tree.chain(trunk[-1], self._farthest(first, (Kind.HEAD,), Side.CENTRE))
            called = [joint for joint in chain[1:] if self._is(joint, Kind.HEAD)]
            neckless = len(called) == len(chain) - 1 and len(called) > 2
            return chain, self._end_of_neck(chain) if neckless else first
        spine = self._onward(trunk[-1], lambda part: part is not None and part.kind in _SPINE)
        if len(spine) > 1:
            return spine, spine[-1]
        chain = self._onward(trunk[-1], lambda part: part is None)
        return (chain, self._end_of_neck(chain)) if len(chain) > 2 else ((), None)

    def fingers(self) -> Iterator[tuple[tuple[Side, Kind], Chain]]:
        """Each finger from its knuckle to its tip."""
        for side in SIDES:
            for kind in FINGERS[:-1]:
                knuckle = self._first(kind, side)
                if knuckle is None:
                    continue
                own = list(self._own((kind,), side, self._tree.subtree(knuckle), tips=True))
                chain = self._tree.chain(knuckle, own[-1])
                if len(chain) > 1:
                    yield (side, kind), chain

    def tail(self, trunk: Chain, head: Chain) -> Chain:
        """From the joint that the tail hangs on to its tip; a spine that leads away is one too."""
        first = self._first(Kind.TAIL, Side.CENTRE)
        if first is not None:
            parent = int(self._tree.parents[first])
            tip = self._farthest(first, (Kind.TAIL,), Side.CENTRE)
            return self._tree.chain(parent if parent >= 0 else first, tip)
        taken = {*trunk, *head}
        return max(
            (
                (
                    trunk[0],
                    *self._onward(child, lambda part: part is not None and part.kind in _SPINE),
                )
                for child in self._tree.children[trunk[0]]
                if child not in taken and self._is(child, *_SPINE) and len(trunk) > 1
            ),
            key=len,
            default=(),
        )

    def _limb(self, kinds: Sequence[Kind], side: Side) -> Limb | None:
        """The limb whose parts are called so; None where its beginning is not known."""
        start = next((j for kind in kinds if (j := self._first(kind, side)) is not None), None)
        if start is None:
            return None
        middle = self._below(start, kinds[1:2], side) if self._is(start, kinds[0]) else None
        outer = start if middle is None else middle
        end = self._hand(outer, side) if kinds is _ARM else self._below(outer, kinds[2:3], side)
        if middle is None and end is None:
            segments = self._divided(start, kinds, side)
        else:
            segments = self._named(start, middle, end, kinds, side)
        return Limb(*segments[:3]) if segments else None

    def _named(
        self, start: int, middle: int | None, end: int | None, kinds: Sequence[Kind], side: Side
    ) -> list[Chain]:
        """The segments of a limb between joints with names."""
        marks = [joint for joint in (start, middle, end) if joint is not None]
        segments = [self._chain(near, far) for near, far in pairwise(marks)]
        if middle is None and len(segments[0]) > 2:
            segments = list(bend_between(segments[0], self._skeleton.rest_positions))
        segments.append(self._end(marks[-1], kinds, side))
        return [segment for segment in segments if segment]

    def _divided(self, start: int, kinds: Sequence[Kind], side: Side) -> list[Chain]:
        """The segments of a limb whose joints are all named alike."""
        chain = self._tree.chain(start, self._farthest(start, kinds, side))
        divide = leg_segments if kinds is _LEG else arm_segments
        return list(divide(chain, self._skeleton.rest_positions))

    def _hand(self, outer: int, side: Side) -> int | None:
        """The wrist: the joint that hands and fingers hang on, else the first one of a hand."""
        wrist = self._below(outer, (Kind.HAND,), side)
        if wrist is None:
            return None
        hands = self._own((Kind.HAND, *FINGERS), side, self._tree.subtree(outer), tips=True)
        paths = [self._tree.chain(outer, joint) for joint in hands]
        shared = [nodes[0] for nodes in zip(*paths, strict=False) if len(set(nodes)) == 1]
        carrier = shared[-1] if len(shared) > 1 else wrist
        return carrier if self._is(carrier, Kind.HAND) else wrist

    def _end(self, joint: int, kinds: Sequence[Kind], side: Side) -> Chain:
        """From the last known joint of a limb to the end of hand or foot; empty for none."""
        ranks = (Kind.MIDDLE, Kind.INDEX, Kind.FINGER, Kind.HAND) if kinds is _ARM else kinds[:1:-1]
        for kind in ranks:
            for other in self._own((kind,), side, self._tree.subtree(joint)[1:], tips=True):
                chain = self._chain(joint, other)
                if chain:
                    return chain
        return ()

    def _hips(self, legs: Mapping[Side, Limb]) -> int:
        """The hips; without that name, what the legs hang on, or where the spine begins."""
        hips = self._first(Kind.HIPS, Side.CENTRE)
        if hips is not None:
            return hips
        if len(legs) == len(SIDES):
            left, right = (self._tree.chain(self._tree.root, legs[s].upper[0]) for s in SIDES)
            fork = [a for a, b in zip(left[:-1], right[:-1], strict=False) if a == b]
            if fork and not self._is(fork[-1], Kind.ROOT):
                return fork[-1]
        spine = next((j for j in self._tree.order if self._is(j, *_SPINE)), None)
        return self._tree.root if spine is None else spine

    def _end_of_neck(self, chain: Chain) -> int:
        pieces = neck_and_head(chain, self._skeleton.rest_positions)
        return pieces[0][-1] if len(pieces) > 1 else chain[-1]

    def _onward(self, joint: int, called: Callable[[BodyPart | None], bool]) -> Chain:
        """The longest way down from a joint over joints that are called so."""
        heights = self._tree.heights
        chain = [joint]
        while True:
            below = [j for j in self._tree.children[chain[-1]] if called(self.parts[j])]
            if not below:
                return tuple(chain)
            chain.append(max(below, key=lambda j: (float(heights[j]), -j)))

    def _farthest(self, start: int, kinds: Sequence[Kind], side: Side) -> int:
        """The joint of some kinds that is farthest from `start` along bones below it.

        The way there leads over no joint that is of the face.
        """
        reach = {start: 0.0}
        for joint in self._tree.subtree(start)[1:]:
            parent = int(self._tree.parents[joint])
            if parent in reach and not self._is(joint, Kind.FACE):
                reach[joint] = reach[parent] + float(self._tree.bone_lengths[joint])
        own = [start, *self._own(kinds, side, reach, tips=True)]
        return max(own, key=lambda joint: (reach[joint], -joint))

    def _first(self, kind: Kind, side: Side) -> int | None:
        return first_of(self.parts, self._skeleton, kind, side)

    def _below(self, upper: int, kinds: Sequence[Kind], side: Side) -> int | None:
        """The first joint of some kinds below another one."""
        return next(iter(self._own(kinds, side, self._tree.subtree(upper)[1:])), None)

    def _is(self, joint: int, *kinds: Kind) -> bool:
        part = self.parts[joint]
        return part is not None and part.kind in kinds

    def _own(
        self, kinds: Sequence[Kind], side: Side, joints: Iterable[int], *, tips: bool = False
    ) -> Iterator[int]:
        """Those of `joints` that are called so; `tips`: also joints that only end a part."""
        for joint in joints:
            part = self.parts[joint]
            called = part is not None and part.kind in kinds and part.side is side
            if called and part is not None and (tips or not part.tip):
                yield joint

    def _above(self, joint: int) -> Chain:
        return self._tree.chain(self._tree.root, joint)[:-1]

    def _chain(self, near: int, far: int) -> Chain:
        """The joints from one to another; empty where they stand at one place."""
        rest = self._skeleton.rest_positions
        if near == far or np.linalg.norm(rest[far] - rest[near]) < self._least:
            return ()
        return self._tree.chain(near, far)
