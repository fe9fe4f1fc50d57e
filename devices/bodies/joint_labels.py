"""Label each joint of a skeleton with a body part, for any naming convention."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_names import FINGERS, BodyPart, Kind, LimbName, Side, part_of_name
from devices.skeleton import Skeleton

_SIDED = (Side.LEFT, Side.RIGHT)
_LEG = (Kind.UPPER_LEG, Kind.LOWER_LEG)
_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
_ARM_OF_LEG = {
    Kind.HIPS: Kind.SHOULDER,
    Kind.UPPER_LEG: Kind.UPPER_ARM,
    Kind.LOWER_LEG: Kind.LOWER_ARM,
    Kind.FOOT: Kind.HAND,
    Kind.TOES: Kind.HAND,
}
_BY_NUMBER = (Kind.THUMB, Kind.INDEX, Kind.MIDDLE, Kind.RING, Kind.LITTLE)
_ENOUGH = 4  # parts known by name, below which the shape of the skeleton decides
_MOST_JOINTS_BY_SHAPE = 1000  # a larger skeleton is not a body; the search is quadratic


def label_joints(skeleton: Skeleton) -> tuple[BodyPart | None, ...]:
    """Return the body part that begins at each joint; None where it is unknown.

    Names decide first (`devices.bodies.joint_names`). Words that mean different joints in different
    conventions are resolved by the other joints of the same side. Forelegs are arms, unless the
    body has arms as well. If too few names are known, the shape of the rest pose decides; it
    assumes that the performer's left is at +X.
    """
    parts: list[BodyPart | None] = [part_of_name(name) for name in skeleton.names]
    named = sum(part is not None and part.kind is not Kind.ROOT for part in parts)
    if named < min(_ENOUGH, len(parts)) and len(parts) <= _MOST_JOINTS_BY_SHAPE:
        shape = _label_by_shape(skeleton)
        if any(part is not None for part in shape):
            return tuple(shape)
    for side in _SIDED:
        for fore in (False, True):
            _settle_limb(parts, side, skeleton, fore=fore)
        _settle_pairs(parts, side, skeleton)
    _settle_centre(parts, skeleton)
    _settle_fingers(parts, skeleton)
    return tuple(parts)


def heading_joints(skeleton: Skeleton) -> list[tuple[int, int]]:
    """Return pairs of joints (left, right) across which the body faces: hips, shoulders."""
    parts = label_joints(skeleton)
    pairs = []
    for kind in (Kind.UPPER_LEG, Kind.UPPER_ARM):
        left, right = (first_of(parts, skeleton, kind, side) for side in _SIDED)
        if left is not None and right is not None:
            pairs.append((left, right))
    return pairs


def partners(skeleton: Skeleton, parts: Sequence[BodyPart | None]) -> NDArray[np.int64]:
    """Return the same joint (J,) of the other side; a joint in the middle is its own.

    Args:
        skeleton: the joints.
        parts: its labels.
    """
    partner = np.arange(len(parts))
    of_side: dict[Side, dict[tuple[Kind, bool, str, int | None], list[int]]] = {
        side: {} for side in _SIDED
    }
    for joint in skeleton.order:
        part = parts[joint]
        if part is not None and part.side in of_side:
            key = part.kind, part.tip, part.word, part.number
            of_side[part.side].setdefault(key, []).append(joint)
    for key, left in of_side[Side.LEFT].items():
        for a, b in zip(left, of_side[Side.RIGHT].get(key, []), strict=False):
            partner[a], partner[b] = b, a
    return partner


def hips_joint(skeleton: Skeleton) -> int:
    """Return the joint that carries the body: the hips, else the skeleton's root.

    Some rigs put the root on the floor, where it does not follow the body.
    """
    hips = first_of(label_joints(skeleton), skeleton, Kind.HIPS)
    return skeleton.root if hips is None else hips


def first_of(
    parts: Sequence[BodyPart | None], skeleton: Skeleton, kind: Kind, side: Side = Side.CENTRE
) -> int | None:
    """Return the joint nearest to the root that begins `kind` on `side`, or None."""
    for joint in skeleton.order:
        part = parts[joint]
        if part is not None and part.kind is kind and part.side is side and not part.tip:
            return joint
    return None


def _settle_limb(
    parts: list[BodyPart | None], side: Side, skeleton: Skeleton, *, fore: bool
) -> None:
    """Resolve the meaning of "shoulder", "hip", "arm", "leg" and "foot" on one side.

    `fore`: of the forelegs, not of all other limbs.

    Kinect and SMPL name points: the upper arm begins at "ShoulderLeft" and the toes at "FootLeft".
    Rigs name bones: the clavicle is "LeftShoulder" and the shin "LeftLeg".
    """

    members = [
        joint
        for joint in skeleton.order
        if (part := parts[joint]) is not None
        and part.side is side
        and not part.tip
        and (part.limb is LimbName.FORE) is fore
    ]

    def joints(*words: str) -> list[int]:
        return [joint for joint in members if (part := parts[joint]) and part.word in words]

    def has(kind: Kind) -> bool:
        return any((part := parts[joint]) and part.kind is kind for joint in members)

    def settle(chosen: list[int], kind: Kind) -> None:
        for joint in chosen:
            part = parts[joint]
            assert part is not None
            parts[joint] = replace(part, kind=kind)

    if not has(Kind.UPPER_ARM) and (has(Kind.LOWER_ARM) or has(Kind.HAND)):
        settle(joints("shoulder", "shldr")[-1:], Kind.UPPER_ARM)
    if not has(Kind.UPPER_LEG):
        settle(joints("hip")[-1:], Kind.UPPER_LEG)
    legs = joints("leg")
    if not has(Kind.UPPER_LEG) and (len(legs) == 2 or joints("knee", "shin", "calf", "lowerleg")):
        settle(legs[:1], Kind.UPPER_LEG)
    if joints("ankle", "hock", "horselink", "cannon"):
        settle(joints("foot", "paw", "hoof"), Kind.TOES)


def _settle_pairs(parts: list[BodyPart | None], side: Side, skeleton: Skeleton) -> None:
    """Make forelegs arms; of a body that has arms, only the feet that its arms end in.

    The joints of a wing are no arm beside arms or forelegs.
    """

    def of(kinds: Sequence[Kind], limb: LimbName) -> bool:
        return any(p and p.side is side and p.kind in kinds and p.limb is limb for p in parts)

    armed = of(_ARM, LimbName.PLAIN)
    four_legged = not armed and of(_LEG, LimbName.FORE)
    for joint in skeleton.order:
        part = parts[joint]
        if part is None or part.side is not side or not (armed or four_legged):
            continue
        parent = int(skeleton.parents[joint])
        above = parts[parent] if parent >= 0 else None
        on_arm = above is not None and above.side is side and above.kind in _ARM
        if part.limb is LimbName.WING and part.kind in (Kind.SHOULDER, *_ARM):
            parts[joint] = replace(part, kind=Kind.WING)
        elif part.kind in _ARM_OF_LEG and (on_arm or (four_legged and part.limb is LimbName.FORE)):
            parts[joint] = replace(part, kind=_ARM_OF_LEG[part.kind])


def _settle_centre(parts: list[BodyPart | None], skeleton: Skeleton) -> None:
    """Label a branching root as hips if there are no hips, and a nose as head if there is none."""
    if first_of(parts, skeleton, Kind.HIPS) is None:
        for joint in skeleton.order:
            part = parts[joint]
            branches = np.count_nonzero(skeleton.parents == joint) > 1
            if part is not None and part.kind is Kind.ROOT and branches:
                parts[joint] = replace(part, kind=Kind.HIPS)
                break
    if first_of(parts, skeleton, Kind.HEAD) is None:
        for joint, part in enumerate(parts):
            if part is not None and part.word == "nose" and not part.tip:
                parts[joint] = replace(part, kind=Kind.HEAD)
                break


def _settle_fingers(parts: list[BodyPart | None], skeleton: Skeleton) -> None:
    """Resolve numbered fingers, and give a finger without a side the side of its parent.

    MakeHuman counts fingers from 1 and metacarpals from the index finger; 3ds Max Biped counts
    from 0 and writes the second bone of finger 1 as 11.
    """
    numbered = [part for part in parts if part is not None and part.word == "finger"]
    from_zero = any(part.number == 0 for part in numbered)
    for joint in skeleton.order:
        part = parts[joint]
        if part is None or part.kind not in FINGERS:
            continue
        if part.kind is Kind.FINGER and part.number is not None:
            number = int(str(part.number)[0]) if from_zero else part.number - 1
            number = number + 1 if part.word == "metacarpal" else number
            if 0 <= number < len(_BY_NUMBER):
                part = replace(part, kind=_BY_NUMBER[number])
        above = parts[skeleton.parents[joint]] if skeleton.parents[joint] >= 0 else None
        if part.side is Side.CENTRE and above is not None:
            part = replace(part, side=above.side)
        parts[joint] = part


def _label_by_shape(skeleton: Skeleton) -> list[BodyPart | None]:
    """Label an upright body with two legs, two arms and a head from its rest pose alone."""
    parts: list[BodyPart | None] = [None] * len(skeleton.names)
    rest = skeleton.rest_positions
    size = float(np.ptp(rest, axis=0).max())
    hips = _fork(skeleton, skeleton.root, 0.2 * size)
    if hips is None:
        return parts
    limbs = [_longest_chain(skeleton, child) for child in _branches(skeleton, hips, 0.2 * size)]
    legs = _pair([limb for limb in limbs if rest[limb[-1], 1] < rest[hips, 1]], rest, hips)
    rising = [limb for limb in limbs if rest[limb[-1], 1] > rest[hips, 1] + 0.15 * size]
    if legs is None or len(rising) != 1:
        return parts
    chest = _fork(skeleton, rising[0][0], 0.12 * size)
    if chest is None:
        return parts
    limbs = [_longest_chain(skeleton, child) for child in _branches(skeleton, chest, 0.12 * size)]
    arms = _pair(limbs, rest, chest)
    if arms is None:
        return parts
    joint = chest
    while joint != hips:
        parts[joint] = BodyPart(Kind.CHEST if joint == chest else Kind.SPINE)
        joint = int(skeleton.parents[joint])
    parts[hips] = BodyPart(Kind.HIPS)
    for limb in limbs:
        if limb not in arms:
            parts[limb[0]] = BodyPart(Kind.NECK if len(limb) > 1 else Kind.HEAD)
            for joint in limb[1:]:
                parts[joint] = BodyPart(Kind.HEAD)
    for side, arm, leg in zip(_SIDED, arms, legs, strict=True):
        _label_limb(parts, rest, arm, (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND), side)
        _label_limb(parts, rest, leg, (Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT), side)
    return parts


def _branches(skeleton: Skeleton, joint: int, least: float) -> list[int]:
    """Children of `joint` whose branch reaches at least `least` [m] away from `joint`."""
    rest = skeleton.rest_positions
    return [
        int(child)
        for child in np.flatnonzero(skeleton.parents == joint)
        if np.linalg.norm(rest[_longest_chain(skeleton, int(child))] - rest[joint], axis=1).max()
        >= least
    ]


def _fork(skeleton: Skeleton, joint: int, least: float) -> int | None:
    """The first joint from `joint` outwards at which three or more long branches meet."""
    while True:
        branches = _branches(skeleton, joint, least)
        if len(branches) >= 3:
            return joint
        if len(branches) != 1:
            return None
        joint = branches[0]


def _longest_chain(skeleton: Skeleton, joint: int) -> list[int]:
    """Joints from `joint` to the leaf that is farthest along the bones."""
    rest = skeleton.rest_positions
    length = {joint: 0.0}
    for child in skeleton.order:
        parent = int(skeleton.parents[child])
        if parent in length and child != joint:
            length[child] = length[parent] + float(np.linalg.norm(rest[child] - rest[parent]))
    chain = [max(length, key=lambda end: length[end])]
    while chain[-1] != joint:
        chain.append(int(skeleton.parents[chain[-1]]))
    return chain[::-1]


def _pair(
    limbs: list[list[int]], rest: NDArray[np.float64], centre: int
) -> tuple[list[int], list[int]] | None:
    """The two limbs, left first, that end farthest to either side, if they have equal lengths."""
    if len(limbs) < 2:
        return None
    ends = [float(rest[limb[-1], 0] - rest[centre, 0]) for limb in limbs]
    left, right = int(np.argmax(ends)), int(np.argmin(ends))
    if ends[left] <= 0 or ends[right] >= 0 or len(limbs[left]) != len(limbs[right]):
        return None
    return limbs[left], limbs[right]


def _label_limb(
    parts: list[BodyPart | None],
    rest: NDArray[np.float64],
    limb: list[int],
    kinds: tuple[Kind, Kind, Kind],
    side: Side,
) -> None:
    """Label a chain from its start: the elbow or knee lies halfway, the hand or foot at the end."""
    along = np.linalg.norm(np.diff(rest[limb], axis=0), axis=1).cumsum()
    for place, joint in enumerate(limb):
        s = along[place - 1] / max(along[-1], 1e-12) if place else 0.0
        parts[joint] = BodyPart(kinds[0 if s < 0.35 else 1 if s < 0.75 else 2], side)
