"""The hands in one message of the Leap Motion's WebSocket protocol, live or recorded.

Protocol 6 gives every finger's bones and says which hand is which; protocols before it give palms
and finger tips only. Fingers belong to a hand by its id, in any order. What is odd is not there:
a number that is none, a vector that is not three of them, a finger without a hand.
Source: leapjs, lib/frame.js, hand.js, finger.js; Leap developer archive, "JSON Frame".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.leap_joints import FINGERS, HAND_PARENTS, PALM, SIDES
from devices.leap_tips import Tip

Array = NDArray[np.float64]

FARTHEST_MM = 1e5
_PLACES = {"elbow": "elbow", "wrist": "wrist", PALM: "palmPosition"}
_ENDS = {
    finger: [name for name in HAND_PARENTS if name.startswith(f"{finger}_")] for finger in FINGERS
}
# The bone that starts at a joint, of the four of a finger: metacarpal, proximal, intermediate,
# distal. The tip, where none starts, keeps the turn of the last.
_BONE_FROM = {"mcp": 1, "pip": 2, "dip": 3, "tip": 3}
_SQUARE = 0.05  # how far a basis may be from orthonormal and still be one


@dataclass(slots=True)
class Hand:
    """One hand of one message.

    Attributes:
        id: the device's number for it; another one after the hand was lost.
        side: "left", "right", or None where the device does not say.
        confidence: in [0, 1].
        joints: (3,) [mm, device axes] by joint name.
        direction: (3,) from the palm to the fingers, device axes; NaN where unknown.
        normal: (3,) out of the palm, device axes; NaN where unknown.
        tips: finger tips that the message does not name.
        bases: by joint name the axes (3, 3) of the bone that starts there, in device axes: the
            columns are the axis it flexes about, up out of its back, and back along it. Of a left
            hand, which the device measures with a left-handed basis, the first is turned round, so
            that every basis is a rotation.
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
    """One message: the device's time [us] or None, the rate it states, and its hands."""

    timestamp: float | None
    rate: float | None
    hands: list[Hand]


def leap_frame(message: Mapping[str, Any]) -> LeapFrame:
    """The frame that a decoded message shows; hands without a palm are left out."""
    hands = {hand.id: hand for hand in map(_hand, _objects(message.get("hands")))}
    for pointable in _objects(message.get("pointables")):
        hand = hands.get(_whole(pointable.get("handId")))
        if hand is not None and pointable.get("tool") is not True:
            _add_finger(hand, pointable)
    return LeapFrame(
        timestamp=number(message.get("timestamp")),
        rate=number(message.get("currentFrameRate")),
        hands=[hand for hand in hands.values() if PALM in hand.joints],
    )


def palm_basis(direction: Array, normal: Array) -> Array | None:
    """Axes (3, 3) of a palm: across it, up out of its back, back from the fingers; or None."""
    return rotation(np.stack([np.cross(normal, direction), -normal, -direction], axis=1))


def rotation(basis: Array) -> Array | None:
    """A basis (3, 3), its axes in columns, with the first axis turned round if it is left-handed;
    None if it is none."""
    if not np.abs(basis.T @ basis - np.eye(3)).max() < _SQUARE:
        return None  # NaN, too
    return basis * [-1.0, 1.0, 1.0] if np.linalg.det(basis) < 0 else basis


def number(value: Any) -> float | None:
    """A finite number, or None for anything else that JSON can hold."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    found = float(value) if abs(value) < 1e300 else math.inf
    return found if math.isfinite(found) else None


def _hand(found: Mapping[str, Any]) -> Hand:
    confidence = number(found.get("confidence"))
    side = found.get("type")
    hand = Hand(
        id=_whole(found.get("id")),
        side=side if side in SIDES else None,
        confidence=1.0 if confidence is None else min(max(confidence, 0.0), 1.0),
        joints=_seen({name: found.get(key) for name, key in _PLACES.items()}),
        direction=_vector(found.get("direction")),
        normal=_vector(found.get("palmNormal")),
    )
    arm = _basis(found.get("armBasis"))
    turns = {PALM: palm_basis(hand.direction, hand.normal), "wrist": arm, "elbow": arm}
    hand.bases = {name: turn for name, turn in turns.items() if turn is not None}
    return hand


def _add_finger(hand: Hand, pointable: Mapping[str, Any]) -> None:
    tip = _vector(pointable.get("tipPosition"))
    if "mcpPosition" not in pointable:
        if np.isfinite(tip).all():
            hand.tips.append(Tip(_whole(pointable.get("id")), tip))
        return
    kind = _whole(pointable.get("type"))
    if kind < 0:  # the packed form leaves it out; ids are 10 * hand + finger
        kind = _whole(pointable.get("id")) % 10
    if kind >= len(FINGERS):
        return
    finger = FINGERS[kind]
    ends = {name: name.removeprefix(f"{finger}_") for name in _ENDS[finger]}
    hand.joints.update(_seen({name: pointable.get(f"{e}Position") for name, e in ends.items()}))
    bones = pointable.get("bases")
    if isinstance(bones, list) and len(bones) == 4:
        for name, end in ends.items():
            turn = _basis(bones[_BONE_FROM[end]])
            if turn is not None:
                hand.bases[name] = turn


def _objects(found: Any) -> list[dict[str, Any]]:
    return [item for item in found if isinstance(item, dict)] if isinstance(found, list) else []


def _seen(vectors: Mapping[str, Any]) -> dict[str, Array]:
    found = {name: _vector(value) for name, value in vectors.items()}
    return {name: vector for name, vector in found.items() if np.isfinite(vector).all()}


def _basis(value: Any) -> Array | None:
    if not isinstance(value, list) or len(value) != 3:
        return None
    return rotation(np.stack([_vector(axis) for axis in value], axis=1))


def _vector(value: Any) -> Array:
    numbers = [number(item) for item in value] if isinstance(value, list) else []
    if len(numbers) != 3 or any(n is None or abs(n) > FARTHEST_MM for n in numbers):
        return np.full(3, np.nan)
    return np.array(numbers, dtype=np.float64)


def _whole(value: Any) -> int:
    return value if isinstance(value, int) else -1
