"""The plan of a hand: its arm and its fingers; and two hands as the arms of a body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from devices.bodies.body_plan import SIDES, BodyPlan, Chain, Limb
from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import FINGERS, BodyPart, Kind, Side
from devices.skeleton import Skeleton

NAMED = FINGERS[:-1]
"""The fingers of a hand, from the thumb on."""

_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
_FEWEST = 3  # fingers


@dataclass(frozen=True, slots=True)
class HandPlan:
    """A hand and the arm that carries it.

    Attributes:
        side: of the body that it belongs to; the centre where nothing says it.
        arm: joints from the outermost that is known of the arm to the palm, which fingers hang on.
        fingers: by kind, each from the palm to its tip.
    """

    side: Side
    arm: Chain
    fingers: Mapping[Kind, Chain]

    @property
    def palm(self) -> int:
        """The joint that the fingers hang on."""
        return self.arm[-1]

    @property
    def knuckle(self) -> int | None:
        """Where the finger in the middle begins; None where only tips of fingers are known."""
        for kind in (Kind.MIDDLE, Kind.RING, Kind.INDEX):
            finger = self.fingers.get(kind, ())
            if len(finger) > 2:
                return finger[1]
        return None


def hands_by_names(skeleton: Skeleton) -> list[HandPlan]:
    """Return the hands whose fingers have known names, the right one first."""
    parts = label_joints(skeleton)
    sides = (Side.RIGHT, Side.LEFT, Side.CENTRE)
    found = [_hand(skeleton, parts, side) for side in sides]
    return [hand for hand in found if hand is not None]


def body_of_hands(skeleton: Skeleton) -> BodyPlan | None:
    """Return two hands without a body as the arms of one; None unless there are two.

    Where they hang on a joint that stands for the chest, the arms begin there. Else nothing shows
    where the arms are, and each points where its hand does.
    """
    hands = {hand.side: hand for hand in hands_by_names(skeleton)}
    if not all(side in hands for side in SIDES):
        return None
    parts, root = label_joints(skeleton), skeleton.root
    top = parts[root]
    chest = (root,) if top is not None and top.kind is Kind.HAND else ()
    return BodyPlan(
        trunk=(root,),
        arms={side: _arm(parts, hands[side], chest) for side in SIDES},
        fingers={
            (side, kind): finger[1:] if len(finger) > 2 else finger
            for side in SIDES
            for kind, finger in hands[side].fingers.items()
        },
    )


def _hand(skeleton: Skeleton, parts: Sequence[BodyPart | None], side: Side) -> HandPlan | None:
    tree = skeleton.tree
    tips = {
        part.kind: joint
        for joint in tree.order
        if (part := parts[joint]) is not None and part.side is side and part.kind in NAMED
    }
    if len(tips) < _FEWEST:
        return None
    ways = [tree.chain(tree.root, tip)[:-1] for tip in tips.values()]
    shared = [joints[0] for joints in zip(*ways, strict=False) if len(set(joints)) == 1]
    if not shared:
        return None
    palm, start = shared[-1], len(shared) - 1
    while start > 0 and _is_of_arm(parts[shared[start - 1]], side):
        start -= 1
    fingers = {kind: tree.chain(palm, tips[kind]) for kind in NAMED if kind in tips}
    return HandPlan(side, tuple(shared[start:]), fingers)


def _is_of_arm(part: BodyPart | None, side: Side) -> bool:
    return part is not None and part.side is side and part.kind in _ARM


def _arm(parts: Sequence[BodyPart | None], hand: HandPlan, chest: Chain) -> Limb:
    """The arm of a hand from the chest, or without one from what is known of it."""
    wrist = next(
        place
        for place, joint in enumerate(hand.arm)
        if ((part := parts[joint]) is not None and part.kind is Kind.HAND) or joint == hand.palm
    )
    tip = next(iter(hand.fingers.values()))[-1] if hand.knuckle is None else hand.knuckle
    near, end = (*chest, *hand.arm[: wrist + 1]), (*hand.arm[wrist:], tip)
    if len(near) == 1:
        return Limb(end)
    return Limb(near[:2], near[1:], end) if len(near) > 2 else Limb(near, (), end)
