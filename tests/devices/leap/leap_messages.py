"""Messages of a Leap service: hands, fingers, device events, and hostile ones."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from devices.leap.websocket_messages import LeapDecoder
from devices.skeleton import SkeletonFrame

ENDS = ("carp", "mcp", "pip", "dip", "btip", "tip")
HEADER = {"version": 6, "serviceVersion": "2.3.1"}


def hand(number: int, side: str | None, x: float, **more: Any) -> dict[str, Any]:
    """A level hand, palm down, 20 cm over the device, its arm towards the user."""
    axes = [[-1.0 if side == "left" else 1.0, 0, 0], [0, 1, 0], [0, 0, 1]]
    found: dict[str, Any] = {
        "id": number,
        "confidence": 0.75,
        "palmPosition": [x, 200.0, 50.0],
        "palmNormal": [0.0, -1.0, 0.0],
        "direction": [0.0, 0.0, -1.0],
        "wrist": [x, 190.0, 120.0],
        "elbow": [x, 150.0, 350.0],
        "armBasis": axes,
    }
    return found | ({"type": side} if side else {}) | more


def finger(of: int, kind: int, x: float, bend: float = 0.0, side: str = "right") -> dict[str, Any]:
    """A finger straight ahead; its distal bone bent down by `bend` [rad]."""
    ends = {f"{end}Position": [x, 200.0, 45.0 - 25.0 * i] for i, end in enumerate(ENDS)}
    turn = Rotation.from_rotvec([-bend, 0, 0]).as_matrix()
    first = -1.0 if side == "left" else 1.0
    straight = [[first, 0, 0], [0, 1, 0], [0, 0, 1]]
    bent = (turn @ np.diag([first, 1.0, 1.0])).T.tolist()
    bases = [straight, straight, straight, bent]
    return {"id": 10 * of + kind, "handId": of, "type": kind, "tool": False, "bases": bases} | ends


def fingers(of: int, x: float, **more: Any) -> list[dict[str, Any]]:
    return [finger(of, kind, x + 20.0 * (kind - 2), **more) for kind in range(5)]


def message(index: int, hands: list[Any], pointables: list[Any]) -> dict[str, Any]:
    return {
        "id": index,
        "timestamp": 5_000_000 + 10_000 * index,
        "currentFrameRate": 100.0,
        "hands": hands,
        "pointables": pointables,
        "interactionBox": {"center": [0, 200, 0], "size": [235, 235, 147]},
        "r": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "s": 1,
        "t": [0, 0, 0],
    }


def both(index: int, x: float = 80.0) -> dict[str, Any]:
    """Both hands; which comes first in the message changes."""
    hands = [hand(1, "left", -x), hand(2, "right", x)]
    points = fingers(1, -x, side="left") + fingers(2, x)
    return message(index, hands[:: (-1) ** index], points[:: (-1) ** index])


def feed(decoder: LeapDecoder, found: Any, arrival: float = 0.0) -> SkeletonFrame:
    (frame,) = decoder.feed(json.dumps(found).encode(), arrival)
    return frame


def place(decoder: LeapDecoder, frame: SkeletonFrame, name: str) -> np.ndarray:
    return frame.positions[decoder.skeleton.index(name)]


def device_event(attached: bool, streaming: bool, name: str = "L1") -> bytes:
    state = {"attached": attached, "streaming": streaming, "id": name, "type": "peripheral"}
    return json.dumps({"event": {"type": "deviceEvent", "state": state}}).encode()


HOSTILE = [
    b"",
    b"\xff\xfe{}",
    b"[]",
    b"null",
    b"{",
    b'{"hands": 3}',
    b'{"version": true}',
    b'{"version": "6"}',
    b'{"event": 3}',
    b'{"event": {"state": {}}}',
    b"[" * 100_000,
    b'{"a":' * 100_000,
    b'{"hands": [' + b"1," * 600_000 + b"1]}",
    b'{"timestamp": ' + b"9" * 100_000 + b', "hands": 1}',
]
