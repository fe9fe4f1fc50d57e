"""The performer joints that drive a character, chosen with `--source` by preset or by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import FINGERS, BodyPart, Kind, Side
from devices.bodies.trunk_and_limbs import above, trunk_and_limbs
from devices.errors import InputError
from devices.skeleton import Skeleton

PRESETS = (
    "whole",
    "upper",
    "arms",
    "legs",
    "left-arm",
    "right-arm",
    "left-leg",
    "right-leg",
    "hand",
    "left-hand",
    "right-hand",
    "spine",
)
_TRUNK = (Kind.HIPS, Kind.SPINE, Kind.CHEST, Kind.NECK, Kind.HEAD)
_ARM = (Kind.UPPER_ARM, Kind.LOWER_ARM, Kind.HAND)
_LEG = (Kind.UPPER_LEG, Kind.LOWER_LEG, Kind.FOOT, Kind.TOES)
_SIDES = (Side.LEFT, Side.RIGHT)
_FEWEST_FINGERS = 3  # named fingers of a usable hand preset; a Kinect hand has a thumb and a tip


def available_presets(skeleton: Skeleton) -> tuple[str, ...]:
    """Return the presets of `--source` that this skeleton supports, in the order of `PRESETS`."""
    chosen = _presets(skeleton)
    return tuple(name for name in PRESETS if name in chosen)


def source_joints(skeleton: Skeleton, source: str) -> list[int]:
    """Return the joints that `--source` chooses, parents first; they need not be connected.

    Args:
        skeleton: the performer's skeleton.
        source: a preset, or names of joints and presets separated by commas. Case does not matter,
            a name space ("mixamorig:") may be omitted, and an unambiguous beginning of a name is
            enough.

    Raises:
        InputError: an item is neither a joint nor a preset, names several joints, or is a preset
            that this skeleton lacks; the message lists the available ones.
    """
    chosen: set[int] = set()
    items = [item.strip() for item in source.split(",") if item.strip()]
    if not items:
        raise InputError(f"--source is empty; give a preset ({_listed(PRESETS)}) or joint names")
    presets = _presets(skeleton)
    for item in items:
        if item.lower() in presets:
            chosen.update(presets[item.lower()])
        else:
            chosen.add(_joint_called(skeleton, item))
    return [joint for joint in skeleton.order if joint in chosen]


def source_tree(skeleton: Skeleton, joints: Iterable[int]) -> tuple[NDArray[np.int64], list[int]]:
    """Return the tree that the chosen joints form; each joint hangs on its nearest chosen ancestor.

    If the result would have several roots, their nearest common ancestor is added: two arms are
    joined at the chest.

    Returns:
        parents (K,): index into `joints` of each joint's parent, -1 for the root.
        joints: K joint indices of the skeleton, parents before children.

    Raises:
        InputError: no joint is chosen.
    """
    chosen = set(joints)
    if not chosen:
        raise InputError("no joint of the performer is chosen as a source; give --source joints")
    roots = [joint for joint in chosen if above(skeleton, joint, chosen) is None]
    if len(roots) > 1:
        chosen.add(_common_ancestor(skeleton, roots))
    ordered = [joint for joint in skeleton.order if joint in chosen]
    place = {joint: index for index, joint in enumerate(ordered)}
    hung = [above(skeleton, joint, chosen) for joint in ordered]
    parents = np.array([-1 if joint is None else place[joint] for joint in hung], dtype=np.int64)
    return parents, ordered


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _joint_called(skeleton: Skeleton, name: str) -> int:
    """Return the one joint that `name` refers to; see `source_joints`."""
    if name in skeleton.names:
        return skeleton.names.index(name)
    plain = name.lower()
    full = [known.lower() for known in skeleton.names]
    bare = [known.replace("|", ":").rsplit(":", 1)[-1].strip() for known in full]
    found = [joint for joint, names in enumerate(zip(full, bare, strict=True)) if plain in names]
    if not found and plain not in PRESETS:
        found = [
            joint
            for joint, names in enumerate(zip(full, bare, strict=True))
            if any(known.startswith(plain) for known in names)
        ]
    if len(found) == 1:
        return found[0]
    if found:
        several = _listed(skeleton.names[joint] for joint in found[:8])
        raise InputError(f"--source {name!r} matches {len(found)} joints: {several}; give one name")
    there = _listed(available_presets(skeleton))
    if plain in PRESETS:
        raise InputError(f"this performer has no {plain!r}; --source can be: {there}")
    joints = _listed(skeleton.names[:60]) + (" ..." if len(full) > 60 else "")
    raise InputError(
        f"--source {name!r} is not a joint of this performer; presets: {there}; joints: {joints}"
    )


def _common_ancestor(skeleton: Skeleton, joints: Sequence[int]) -> int:
    """The joint nearest to the root that all paths from the root to `joints` share last."""
    paths = [skeleton.tree.chain(skeleton.root, joint) for joint in joints]
    return next(joint for joint in reversed(paths[0]) if all(joint in path for path in paths))


@lru_cache(maxsize=64)
def _presets(skeleton: Skeleton) -> dict[str, tuple[int, ...]]:
    """The joints of each preset that the skeleton supports."""
    parts = label_joints(skeleton)
    hands = {side: _hand(parts, side) for side in (*_SIDES, Side.CENTRE)}
    if not _is_body(parts):
        chosen = {"whole": tuple(skeleton.order)}
    else:
        chosen = _body_presets(skeleton, parts)
    for side in _SIDES:
        if hands[side]:
            chosen[f"{side}-hand"] = hands[side]
    hand = hands[Side.RIGHT] or hands[Side.LEFT] or hands[Side.CENTRE]
    if hand:
        chosen["hand"] = hand
    return chosen


def _is_body(parts: Sequence[BodyPart | None]) -> bool:
    """Whether the labels describe a body: a trunk with limbs on both sides."""
    there = {(part.kind, part.side) for part in parts if part is not None}
    limbs = any(
        all((kind, side) in there for side in _SIDES) for kind in (Kind.UPPER_ARM, Kind.UPPER_LEG)
    )
    return limbs and any(kind in _TRUNK for kind, _ in there)


def _body_presets(
    skeleton: Skeleton, parts: Sequence[BodyPart | None]
) -> dict[str, tuple[int, ...]]:
    whole = trunk_and_limbs(skeleton, parts)
    part_of = {joint: _limb_part(skeleton, parts, joint) for joint in whole}

    def of(kinds: tuple[Kind, ...], sides: tuple[Side, ...]) -> tuple[int, ...]:
        return tuple(j for j in whole if (p := part_of[j]) and p.kind in kinds and p.side in sides)

    chosen: dict[str, tuple[int, ...]] = {"whole": whole}
    arms = {side: of(_ARM, (side,)) for side in _SIDES}
    legs = {side: of(_LEG, (side,)) for side in _SIDES}
    for name, limbs in (("arm", arms), ("leg", legs)):
        for side in _SIDES:
            if len(limbs[side]) >= 2:
                chosen[f"{side}-{name}"] = limbs[side]
        if all(len(limbs[side]) >= 2 for side in _SIDES):
            chosen[f"{name}s"] = (*limbs[Side.LEFT], *limbs[Side.RIGHT])
    spine = of(_TRUNK, (Side.CENTRE,))
    if len(spine) >= 2:
        chosen["spine"] = spine
        if "arms" in chosen:
            chosen["upper"] = (*spine, *of((Kind.SHOULDER,), _SIDES), *chosen["arms"])
    return chosen


def _limb_part(skeleton: Skeleton, parts: Sequence[BodyPart | None], joint: int) -> BodyPart | None:
    """The part of a joint; a knuckle that was kept as the end of the hand counts as hand."""
    part = parts[joint]
    if part is not None and part.kind in FINGERS:
        return BodyPart(Kind.HAND, part.side, tip=True)
    return part


def _hand(parts: Sequence[BodyPart | None], side: Side) -> tuple[int, ...]:
    """Wrist, palm and fingers of one side, or () if too few fingers are labelled."""
    there = [
        (joint, part)
        for joint, part in enumerate(parts)
        if part is not None and part.side is side and part.kind in (Kind.HAND, *FINGERS)
    ]
    fingers = {part.kind for _, part in there if part.kind in FINGERS}
    tips = sum(part.kind is Kind.FINGER for _, part in there)
    enough = len(fingers) >= _FEWEST_FINGERS or (Kind.FINGER in fingers and tips >= 6)
    return tuple(joint for joint, _ in there) if enough else ()
