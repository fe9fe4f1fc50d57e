"""Bytes of one frame of each Kinect SDK, packed by hand."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np


def v1_packet(people: dict[int, tuple[int, int, Sequence[float]]], floor: Sequence[float]) -> bytes:
    """A frame with people in slots: tracking state, id, and the place of every joint."""
    data = struct.pack("<qII4f4f", 1500, 1, 0, *floor, 0, 1, 0, 0)
    bones = b""
    for slot in range(6):
        state, body, place = people.get(slot, (0, 0, (0.0, 0.0, 0.0)))
        data += struct.pack("<4I4f", state, body, 0, 0, *place, 1)
        data += struct.pack("<4f", *place, 1) * 20
        data += struct.pack("<20I", *(joint % 3 for joint in range(20))) + bytes(4)
        for joint in range(20):
            bones += struct.pack("<2I", joint, 0) + bytes(80 + 64)
            bones += struct.pack("<4f", 0, 0, np.sin(0.3), np.cos(0.3)) if joint else bytes(16)
    return data + bones


def v2_packet(people: dict[int, tuple[int, Sequence[float]]], floor: Sequence[float]) -> bytes:
    """A frame with people in slots: id, and the place of every joint."""
    data = struct.pack("<q4f", 15_000_000, *floor)
    for slot in range(6):
        body, place = people.get(slot, (0, (0.0, 0.0, 0.0)))
        data += struct.pack("<QQ", body, slot in people)
        for joint in range(25):
            data += struct.pack("<i3fi", joint, *place, joint % 3)
        for joint in range(25):
            turn = (0, 0, np.sin(0.3), np.cos(0.3)) if joint else (0, 0, 0, 0)
            data += struct.pack("<i4f", joint, *turn)
    return data


def azure_packet(people: dict[int, Sequence[float]], up: Sequence[float]) -> bytes:
    """A frame with people by id: the place of every joint."""
    data = struct.pack("<QI3f", 1_500_000, len(people), *up)
    for body, place in people.items():
        data += struct.pack("<I", body)
        for joint in range(32):
            turn = (np.cos(0.3), 0, 0, np.sin(0.3)) if joint else (0, 0, 0, 0)
            data += struct.pack("<3f4fI", *place, *turn, joint % 4)
    return data + bytes(-len(data) % 1)
