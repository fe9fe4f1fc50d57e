"""The joints of a body that a match should see: trunk and limbs, without the clutter of its rig."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from devices.joint_names import Kind, Part, Side
from devices.skeleton import Skeleton

_TRUNK = (Kind.HIPS, Kind.SPINE, Kind.CHEST, Kind.NECK, Kind.HEAD)
_SEVERAL = (Kind.SHOULDER, Kind.HAND)  # a limb may have two: collar and shoulder, wrist and palm
_ONCE = (
    *(Kind.UPPER_ARM, Kind.LOWER_ARM),  # more are twist segments
    *(Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT, Kind.TOES),
)
# Parts of the rest pose's size: face bones that reach so far are a trunk or a snout, unnamed ones
# a wing or a fin; a joint so close to the one above gives its bone no direction.
_LONG_FACE, _LONG_UNNAMED, _COINCIDENT = 0.2, 0.15, 1e-3
_HAND_LENGTH = (0.2, 0.9)  # of the forearm


def trunk_and_limbs(skeleton: Skeleton, parts: Sequence[Part | None]) -> tuple[int, ...]:
    """The joints of trunk and limbs, parents first, without what would blur a match.

    Left out: eyes, ears and the bones of the face, fingers, hand tips and thumbs, twist and helper
    bones, all toes but one, roots on the floor, joints that stand where the one above stands.
    Kept: tails, trunks, wings and other long branches of creatures.

    Args:
        skeleton: the body.
        parts: its labels, see `devices.joint_labels`.
    """
    body = [joint for joint, part in enumerate(parts) if part is None or part.kind is not Kind.ROOT]
    size = max(float(np.ptp(skeleton.rest_positions[body], axis=0).max()), 1e-9)
    children: list[list[int]] = [[] for _ in parts]
    for joint in skeleton.order[1:]:
        children[skeleton.parents[joint]].append(joint)
    kept: set[int] = set()
    taken: set[tuple[Kind, Side]] = set()
    for joint in skeleton.order:
        part, parent = parts[joint], int(skeleton.parents[joint])
        if part is not None and part.kind not in (Kind.FACE, Kind.HELPER):
            keep = _is_trunk_or_limb(part, parent in kept, (part.kind, part.side) in taken)
        elif parent in kept and (part is None or part.kind is Kind.FACE):
            long = (_LONG_UNNAMED if part is None else _LONG_FACE) * size
            keep = _goes_on(parts, joint, parent) or _reach(skeleton, children, joint) >= long
        else:
            keep = False
        if keep:
            kept.add(joint)
            taken.update(() if part is None else ((part.kind, part.side),))
    kept.update(_hand_ends(skeleton, parts, kept))
    kept.update(_foot_ends(parts, taken))
    kept = _apart(skeleton, kept, size)
    return tuple(joint for joint in skeleton.order if joint in kept)


def above(skeleton: Skeleton, joint: int, chosen: set[int]) -> int | None:
    """The nearest ancestor of `joint` that is chosen, or None."""
    parent = int(skeleton.parents[joint])
    while parent >= 0 and parent not in chosen:
        parent = int(skeleton.parents[parent])
    return None if parent < 0 else parent


def _reach(skeleton: Skeleton, children: list[list[int]], joint: int) -> float:
    """How far the branch that begins at `joint` gets from where it hangs [m], at rest."""
    branch = [joint]
    for member in branch:
        branch.extend(children[member])
    rest = skeleton.rest_positions
    hung_at = rest[skeleton.parents[joint]]
    return float(np.linalg.norm(rest[branch] - hung_at, axis=1).max())


def _is_trunk_or_limb(part: Part, hangs: bool, taken: bool) -> bool:
    """`hangs`: the joint above is kept; `taken`: this part already has its joint."""
    if part.kind is Kind.TAIL:
        return True
    central = part.side is Side.CENTRE
    if part.kind is Kind.HEAD and part.tip:
        return hangs and central
    if part.kind in _TRUNK:
        return central and not part.tip
    return not part.tip and (part.kind in _SEVERAL or (part.kind in _ONCE and not taken))


def _goes_on(parts: Sequence[Part | None], joint: int, parent: int) -> bool:
    """Whether a joint continues the trunk, wing or the like to which its kept parent belongs."""
    part, upper = parts[joint], parts[parent]
    if part is None or upper is None:
        return part is upper
    return (upper.kind, upper.side) == (part.kind, part.side)


def _hand_ends(skeleton: Skeleton, parts: Sequence[Part | None], kept: set[int]) -> Iterable[int]:
    """Where a hand is only a wrist so far: its own end, else the knuckle of a middle finger."""
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
    """Whether `end` goes on from the wrist like a hand; some exporters' end sites do not."""
    rest = skeleton.rest_positions
    forearm = rest[wrist] - rest[skeleton.parents[wrist]]
    hand = rest[end] - rest[wrist]
    least, most = (share * float(np.linalg.norm(forearm)) for share in _HAND_LENGTH)
    return least < float(np.linalg.norm(hand)) < most and float(hand @ forearm) > 0


def _foot_ends(parts: Sequence[Part | None], taken: set[tuple[Kind, Side]]) -> Iterable[int]:
    """Where a foot has no toes: its own end."""
    for joint, part in enumerate(parts):
        ends_foot = part is not None and part.kind is Kind.FOOT and part.tip
        if part is not None and ends_foot and (Kind.TOES, part.side) not in taken:
            yield joint


def _distance(skeleton: Skeleton, first: int, second: int) -> float:
    rest = skeleton.rest_positions
    return float(np.linalg.norm(rest[first] - rest[second]))


def _apart(skeleton: Skeleton, kept: set[int], size: float) -> set[int]:
    """`kept` without joints that stand where the kept joint above them does."""
    apart: set[int] = set()
    for joint in skeleton.order:
        if joint in kept:
            hung_on = above(skeleton, joint, apart)
            if hung_on is None or _distance(skeleton, joint, hung_on) > _COINCIDENT * size:
                apart.add(joint)
    return apart
