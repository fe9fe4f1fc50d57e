"""Which chains a performer's hand drives: a hand's fingers, or a body as a glove puppet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from devices.bodies.body_plan import SIDES, BodyPlan, Chain
from devices.bodies.hand_plan import HandPlan, hands_by_names
from devices.bodies.joint_names import Kind, Side
from devices.bodies.plan_by_names import plan_by_names
from runtime.characters.creatures.hand import hand_of
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.pairing import Pairing


def mapping_of_hands(pairing: Pairing) -> Mapping | None:
    """Return what a hand drives by its anatomy, or what drives a character that is a hand.

    A hand drives a hand finger by finger, and its arm the arm. A body lends its right arm, or the
    one of the character's side, with the fingers that are known. A hand alone moves a body as the
    hand in a glove puppet: the index finger its head, thumb and little finger its arms, the palm
    its trunk.

    Returns:
        None where neither is the case, or the body has no arms, so that the pose has to choose.
    """
    performer, free = pairing.performer, frozenset(pairing.joints)
    hands = [hand for hand in hands_by_names(performer) if not free.isdisjoint(hand.arm)]
    body = plan_by_names(performer)
    plan, ours = pairing.character.plan, hand_of(pairing.character)
    if ours is not None:
        drives = _arm_and_fingers(pairing, hands, body, ours)
    elif hands and body is None and plan is not None and plan.arms:
        drives = list(_glove(pairing, hands[0], plan))
    else:
        return None
    return Mapping(tuple(drives)) if drives else None


def _arm_and_fingers(
    pairing: Pairing, hands: Sequence[HandPlan], body: BodyPlan | None, ours: HandPlan
) -> list[Drive]:
    """What moves a hand with its arm, from the arm on."""
    hand = next((hand for hand in hands if hand.side is ours.side), hands[0] if hands else None)
    drives = []
    source = _arm_of(pairing, hand, body, ours.side)
    if len(source) > 1 and len(ours.arm) > 1:
        drives.append(Drive(source, ours.arm))
    if hand is not None:
        for kind, finger in ours.fingers.items():
            theirs = hand.fingers.get(kind)
            target = pairing.skeleton.limb(finger[1:] if len(finger) > 3 else finger)
            if theirs is not None:
                drives.append(Drive(theirs[1:] if len(theirs) > 2 else theirs, target))
    return drives


def _arm_of(pairing: Pairing, hand: HandPlan | None, body: BodyPlan | None, side: Side) -> Chain:
    """The chain of the performer that moves an arm; empty for none."""
    if hand is not None:
        return _palm(hand)
    for own in (side, Side.RIGHT, Side.LEFT):
        arm = body.arms.get(own) if body is not None else None
        if arm is not None and not set(pairing.joints).isdisjoint(arm.chain):
            return (*arm.upper, *arm.lower[1:])
    return ()


def _palm(hand: HandPlan) -> Chain:
    """The chain that shows how a hand is turned: its arm, or without one its palm."""
    knuckle = () if hand.knuckle is None else (hand.knuckle,)
    return hand.arm if len(hand.arm) > 2 else (*hand.arm, *knuckle)


def _glove(pairing: Pairing, hand: HandPlan, plan: BodyPlan) -> Iterator[Drive]:
    """What a hand moves in a glove puppet, from the trunk on.

    Its palm is turned to the audience: then a right hand's thumb is on the left of the body.
    """
    palm = _palm(hand)
    if len(plan.trunk) > 1 and len(palm) > 1:
        yield Drive(palm, plan.trunk)
    index = hand.fingers.get(Kind.INDEX, ())
    if plan.head and index:  # its first bone: a fist bows the head, and does not roll it up
        yield Drive(index[1:3] if len(index) > 2 else index, plan.head)
    sides = SIDES if _thumb_is_left(pairing, hand) else SIDES[::-1]
    for kind, side in zip((Kind.THUMB, Kind.LITTLE), sides, strict=True):
        if side in plan.arms and kind in hand.fingers:
            yield Drive(hand.fingers[kind], plan.arms[side].chain)


def _thumb_is_left(pairing: Pairing, hand: HandPlan) -> bool:
    if hand.side is not Side.CENTRE:
        return hand.side is Side.RIGHT
    if not {Kind.THUMB, Kind.LITTLE} <= set(hand.fingers):
        return True
    rest = pairing.performer.rest_positions
    thumb, little = (hand.fingers[kind][-1] for kind in (Kind.THUMB, Kind.LITTLE))
    return bool(rest[thumb, 0] > rest[little, 0])
