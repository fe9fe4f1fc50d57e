"""Select the joints of trunk and limbs for matching, without fingers, face and rig helpers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from devices.bodies.joint_names import BodyPart, Kind, Side
from devices.skeleton import Skeleton

_TRUNK = (Kind.HIPS, Kind.SPINE, Kind.CHEST, Kind.NECK, Kind.HEAD)
_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM)
_LEG = (Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT, Kind.TOES)
_LIMB = (Kind.SHOULDER, Kind.HAND, *_ARM, *_LEG)
# Shares of the size of the rest pose: face bones of this reach are a trunk or a snout, unnamed ones
# a wing or a fin; a joint this close to its parent gives its bone no direction.
_LONG_FACE, _LONG_UNNAMED, _COINCIDENT = 0.2, 0.15, 1e-3
_HAND_LENGTH = (0.2, 0.9)  # shares of the forearm


def trunk_and_limbs(skeleton: Skeleton, parts: Sequence[BodyPart | None]) -> tuple[int, ...]:
    """Return the joints of trunk and limbs, parents first, without those that blur a match.

    Omitted: eyes, ears and other bones of the face, fingers, hand tips and thumbs, twist and helper
    bones, all toes but one, roots on the floor, joints at the position of their parent.
    Kept: tails, trunks, wings and other long branches of creatures.

    Args:
        skeleton: the body.
        parts: its labels, see `devices.bodies.joint_labels`.
    """
    body = [joint for joint, part in enumerate(parts) if part is None or part.kind is not Kind.ROOT]
    size = max(float(np.ptp(skeleton.rest_positions[body], axis=0).max()), 1e-9)
    kept = _kept(skeleton, parts, size)
    kept.update(_hand_ends(skeleton, parts, kept))
    kept.update(_foot_ends(parts))
    kept = _apart(skeleton, kept, size)
    return tuple(joint for joint in skeleton.order if joint in kept)


def _kept(skeleton: Skeleton, parts: Sequence[BodyPart | None], size: float) -> set[int]:
    """The joints that are kept on their own, before hands and feet get an end."""
    there = {(part.kind, part.side) for part in parts if part is not None}
    kept: set[int] = set()
    endings: set[tuple[Kind, int | None]] = set()  # hands and toes, by their kept parent
    for joint in skeleton.order:
        part, parent = parts[joint], int(skeleton.parents[joint])
        hung_on = above(skeleton, joint, kept)
        upper = None if hung_on is None else parts[hung_on]
        if part is not None and part.kind not in (Kind.FACE, Kind.HELPER):
            again = upper is not None and (upper.kind, upper.side) == (part.kind, part.side)
            keep = (
                (_is_trunk(part, parent in kept) or _is_limb(part))
                and not (again and _is_segment(part, there))
                and (part.kind, hung_on) not in endings
            )
        elif parent in kept and (part is None or part.kind is Kind.FACE):
            long = (_LONG_UNNAMED if part is None else _LONG_FACE) * size
            keep = _goes_on(parts, joint, parent) or _reach(skeleton, parts, joint) >= long
        else:
            keep = False
        if keep:
            kept.add(joint)
        if keep and part is not None and part.kind in (Kind.HAND, Kind.TOES):
            endings.add((part.kind, hung_on))
    return kept


def above(skeleton: Skeleton, joint: int, chosen: set[int]) -> int | None:
    """Return the nearest ancestor of `joint` in `chosen`, or None."""
    parent = int(skeleton.parents[joint])
    while parent >= 0 and parent not in chosen:
        parent = int(skeleton.parents[parent])
    return None if parent < 0 else parent


def _reach(skeleton: Skeleton, parts: Sequence[BodyPart | None], joint: int) -> float:
    """Distance [m] at rest from the parent of `joint` to the farthest joint of its branch.

    Tips do not count: some exporters put end sites half a metre away.
    """
    branch = skeleton.tree.subtree(joint)
    rest = skeleton.rest_positions
    moving = [member for member in branch if not ((part := parts[member]) and part.tip)]
    reach = np.linalg.norm(rest[moving] - rest[skeleton.parents[joint]], axis=1)
    return float(reach.max(initial=0.0))


def _is_trunk(part: BodyPart, hangs: bool) -> bool:
    """Whether a part is trunk, tail, wing or fin; `hangs`: the parent joint is kept."""
    if part.kind in (Kind.TAIL, Kind.WING, Kind.FIN):
        return True
    if part.side is not Side.CENTRE or part.kind not in _TRUNK:
        return False
    return not part.tip or (part.kind is Kind.HEAD and hangs)


def _is_limb(part: BodyPart) -> bool:
    return part.kind in _LIMB and not part.tip


def _is_segment(part: BodyPart, there: set[tuple[Kind, Side]]) -> bool:
    """Whether a second joint of the same limb part only divides its bone, for twist.

    This holds where the names distinguish thigh and shin. In a spider's leg of seven joints that
    are all called leg, each joint bends.
    """
    for whole_limb in (_ARM, _LEG):
        if part.kind in whole_limb:
            return all((kind, part.side) in there for kind in whole_limb[:2])
    return False


def _goes_on(parts: Sequence[BodyPart | None], joint: int, parent: int) -> bool:
    """Whether a joint continues the trunk, wing or similar part of its kept parent."""
    part, upper = parts[joint], parts[parent]
    if part is None or upper is None:
        return part is upper
    return (upper.kind, upper.side) == (part.kind, part.side)


def _hand_ends(
    skeleton: Skeleton, parts: Sequence[BodyPart | None], kept: set[int]
) -> Iterable[int]:
    """The end of a hand that has only a wrist so far: its own end, else a middle-finger knuckle."""
    rank = (Kind.HAND, Kind.MIDDLE, Kind.INDEX, Kind.FINGER, Kind.RING)
    for side in (Side.LEFT, Side.RIGHT):
        hands = [j for j in kept if (p := parts[j]) and p.kind is Kind.HAND and p.side is side]
        if len(hands) != 1:
            continue
        ends = [
            (rank.index(part.kind), depth, joint)
            for depth, joint in enumerate(skeleton.order)
            if (part := parts[joint]) is not None
            and part.side is side
            and part.kind in rank
            and joint not in kept
            and _points_on(skeleton, hands[0], joint)
        ]
        if ends:
            yield min(ends)[2]


def _points_on(skeleton: Skeleton, wrist: int, end: int) -> bool:
    """Whether `end` continues from the wrist like a hand; end sites of some exporters do not."""
    rest = skeleton.rest_positions
    forearm = rest[wrist] - rest[skeleton.parents[wrist]]
    hand = rest[end] - rest[wrist]
    least, most = (share * float(np.linalg.norm(forearm)) for share in _HAND_LENGTH)
    return least < float(np.linalg.norm(hand)) < most and float(hand @ forearm) > 0


def _foot_ends(parts: Sequence[BodyPart | None]) -> Iterable[int]:
    """The end of a foot without toes."""
    toes = {part.side for part in parts if part is not None and part.kind is Kind.TOES}
    for joint, part in enumerate(parts):
        if part is not None and part.kind is Kind.FOOT and part.tip and part.side not in toes:
            yield joint


def _distance(skeleton: Skeleton, first: int, second: int) -> float:
    rest = skeleton.rest_positions
    return float(np.linalg.norm(rest[first] - rest[second]))


def _apart(skeleton: Skeleton, kept: set[int], size: float) -> set[int]:
    """Remove from `kept` the joints at the position of the kept joint above them."""
    apart: set[int] = set()
    for joint in skeleton.order:
        if joint in kept:
            hung_on = above(skeleton, joint, apart)
            if hung_on is None or _distance(skeleton, joint, hung_on) > _COINCIDENT * size:
                apart.add(joint)
    return apart
