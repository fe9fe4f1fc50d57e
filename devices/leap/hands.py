"""Decode the hands in one JSON message of the Leap Motion's WebSocket protocol, live or recorded.

Protocol 6 gives the bones of every finger and the side of each hand; earlier protocols give only
palms and finger tips. A finger refers to its hand by id, in any order. Invalid parts are omitted:
values that are not numbers, vectors that are not three numbers, fingers without a hand.
Source: leapjs, lib/frame.js, hand.js, finger.js; Leap developer archive, "JSON Frame".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.leap.joints import FINGERS, HAND_PARENTS, PALM, SIDES
from devices.leap.tips import Tip

Array = NDArray[np.float64]

FARTHEST_MM = 1e5
MOST_HANDS, MOST_POINTABLES = 64, 512  # of one message
_PLACES = {"elbow": "elbow", "wrist": "wrist", PALM: "palmPosition"}
# The bone that starts at a joint, of the four of a finger: metacarpal, proximal, intermediate,
# distal. No bone starts at the tip, which keeps the rotation of the last one.
_BONE_FROM = {"mcp": 1, "pip": 2, "dip": 3, "tip": 3}
# Of each finger: its joints, their keys in a message, and the bones that start there.
_ENDS = [
    [
        (name, f"{name.removeprefix(finger + '_')}Position", _BONE_FROM[name.rpartition("_")[2]])
        for name in HAND_PARENTS
        if name.startswith(f"{finger}_")
    ]
    for finger in FINGERS
]
_SQUARE = 0.05  # largest deviation of a basis from orthonormal


@dataclass(slots=True)
class Hand:
    """One hand of one message.

    Attributes:
        id: the device's number of the hand; it changes when the hand is lost.
        side: "left", "right", or None if the device does not give it.
        confidence: in [0, 1].
        joints: (3,) [mm, device axes] by joint name.
        direction: (3,) from the palm to the fingers, device axes; NaN if unknown.
        normal: (3,) out of the palm, device axes; NaN if unknown.
        tips: finger tips that the message does not name.
        bases: by joint name the axes (3, 3) of the bone that starts there, in device axes. The
            columns are the axis of flexion, the direction out of the bone's back, and the direction
            backwards along it. The device gives a left hand a left-handed basis; its first column
            is negated, so that every basis is a rotation.
    """

    id: int
    side: str | None
    confidence: float
    joints: dict[str, Array]
    direction: Array
    normal: Array
    tips: list[Tip] = field(default_factory=list)
    bases: dict[str, Array] = field(default_factory=dict)


@dataclass(slots=True)
class LeapFrame:
    """One message: the device's time [us] or None, its stated frame rate, and its hands."""

    timestamp: float | None
    rate: float | None
    hands: list[Hand]


def leap_frame(message: Mapping[str, Any]) -> LeapFrame:
    """Return the frame in a decoded message; hands without a palm are omitted."""
    found = {hand.id: hand for hand in map(_found, _objects(message.get("hands"), MOST_HANDS))}
    for pointable in _objects(message.get("pointables"), MOST_POINTABLES):
        of = found.get(_whole(pointable.get("handId")))
        if of is not None and pointable.get("tool") is not True:
            _add_finger(of, pointable)
    hands = [_hand(hand) for hand in found.values()]
    return LeapFrame(
        timestamp=number(message.get("timestamp")),
        rate=number(message.get("currentFrameRate")),
        hands=[hand for hand in hands if PALM in hand.joints],
    )


def palm_basis(direction: Array, normal: Array) -> Array:
    """Return the axes (3, 3) of a palm: across it, out of its back, back from the fingers; NaN if
    unknown."""
    return np.stack([np.cross(normal, direction), -normal, -direction], axis=1)


def rotations(bases: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Convert bases (n, 3, 3), axes in columns, to rotations: a left-handed basis gets its first
    axis negated. The second result (n,) marks the valid bases."""
    with np.errstate(over="ignore", invalid="ignore"):
        gram = np.swapaxes(bases, 1, 2) @ bases
        close = np.abs(gram - np.eye(3)) < _SQUARE
    known: NDArray[np.bool_] = np.logical_and.reduce(close, axis=(1, 2))
    turned = bases.copy()
    turned[known & (np.linalg.det(np.where(known[:, None, None], bases, 0.0)) < 0.0), :, 0] *= -1.0
    return turned, known


def number(value: Any) -> float | None:
    """Return a finite number, or None for any other JSON value."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    found = float(value) if abs(value) < 1e300 else math.inf
    return found if math.isfinite(found) else None


@dataclass(slots=True)
class _Found:
    """A hand's vectors as in the JSON, by joint, before all are converted to arrays at once."""

    hand: dict[str, Any]
    id: int
    places: dict[str, Any]
    axes: dict[str, Any]
    tips: list[Tip] = field(default_factory=list)


def _found(hand: dict[str, Any]) -> _Found:
    arm = hand.get("armBasis")
    return _Found(
        hand=hand,
        id=_whole(hand.get("id")),
        places={name: hand.get(key) for name, key in _PLACES.items()},
        axes={"elbow": arm, "wrist": arm},
    )


def _add_finger(found: _Found, pointable: Mapping[str, Any]) -> None:
    if "mcpPosition" not in pointable:
        tip = _vector(pointable.get("tipPosition"))
        if tip is not None:
            found.tips.append(Tip(_whole(pointable.get("id")), np.array(tip)))
        return
    kind = _whole(pointable.get("type"))
    if kind < 0:  # the packed form omits it; ids are 10 * hand + finger
        kind = _whole(pointable.get("id")) % 10
    if kind >= len(FINGERS):
        return
    bones = pointable.get("bases")
    several = isinstance(bones, list) and len(bones) == 4
    for name, key, bone in _ENDS[kind]:
        found.places[name] = pointable.get(key)
        if several:
            found.axes[name] = bones[bone]  # type: ignore[index]  # `several` says that it is a list


def _hand(found: _Found) -> Hand:
    confidence = number(found.hand.get("confidence"))
    side = found.hand.get("type")
    direction, normal = (
        np.array(_vector(found.hand.get(key)) or (np.nan,) * 3)
        for key in ("direction", "palmNormal")
    )
    return Hand(
        id=found.id,
        side=side if side in SIDES else None,
        confidence=1.0 if confidence is None else min(max(confidence, 0.0), 1.0),
        joints=_joints(found.places),
        direction=direction,
        normal=normal,
        tips=found.tips,
        bases=_bases(found.axes, palm_basis(direction, normal)),
    )


def _joints(places: Mapping[str, Any]) -> dict[str, Array]:
    seen = {name: _vector(place) for name, place in places.items()}
    names = [name for name, place in seen.items() if place is not None]
    return dict(zip(names, np.array([seen[name] for name in names]), strict=True))


def _bases(axes: Mapping[str, Any], palm: Array) -> dict[str, Array]:
    names, found = [PALM], [palm.T.tolist()]
    for name, basis in axes.items():
        vectors = [_vector(axis) for axis in basis] if isinstance(basis, list) else []
        if len(vectors) == 3 and None not in vectors:
            names.append(name)
            found.append(vectors)
    turned, known = rotations(np.swapaxes(np.array(found), 1, 2))
    return {name: turned[row] for row, name in enumerate(names) if known[row]}


def _objects(found: Any, most: int) -> list[dict[str, Any]]:
    """The objects among the first ones of a list; none of anything else."""
    items = found[:most] if isinstance(found, list) else []
    return [item for item in items if isinstance(item, dict)]


def _vector(value: Any) -> tuple[float, float, float] | None:
    """Three numbers within range, or None."""
    if type(value) is not list or len(value) != 3:
        return None
    x, y, z = value
    if not (type(x) is float and type(y) is float and type(z) is float):
        x, y, z = (number(item) for item in value)
        if x is None or y is None or z is None:
            return None
    near = abs(x) <= FARTHEST_MM and abs(y) <= FARTHEST_MM and abs(z) <= FARTHEST_MM
    return (x, y, z) if near else None  # NaN is not near


def _whole(value: Any) -> int:
    return value if isinstance(value, int) else -1
