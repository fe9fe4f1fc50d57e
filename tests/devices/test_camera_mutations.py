"""Damaged packets of the cameras and hand sensors: no exception, no stall, no growing memory.

CI sends some thousands to each decoder; ``BUNRAKU_MUTATIONS=200000 pytest`` with this file sends as
many as the project's promise names.
"""

from __future__ import annotations

import json
import os
import random
import struct
import tracemalloc
from collections.abc import Callable
from copy import deepcopy

import numpy as np
import pytest

from devices.kinect import azure as kinect_azure
from devices.kinect import v1 as kinect_v1
from devices.kinect import v2 as kinect_v2
from devices.kinect.bodies import KinectDecoder
from devices.leap.sdk import LeapCDecoder
from devices.leap.websocket_messages import LeapDecoder
from devices.mediapipe.landmark_messages import LandmarkDecoder
from devices.skeleton import SkeletonFrame
from devices.transport.senders import Decoder
from runtime.benchmarks.fuzzing.kinect_packets import azure_packet, v1_packet, v2_packet
from tests.devices.leap.leap_messages import HEADER, both, device_event
from tests.devices.mediapipe.test_landmark_stream import SIZE, person, rows, seen_at
from tests.devices.mediapipe.test_landmark_stream import message as landmarks

COUNT = int(os.environ.get("BUNRAKU_MUTATIONS", "1000"))
TOKENS = [
    b"null",
    b"1e999",
    b"-1e308",
    b"NaN",
    b"[]",
    b"{}",
    b'""',
    b"true",
    b"9" * 400,
    b"[" * 500,
]
EXTREMES = [0, 1, 0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 0xFFFFFFFF, 0x80000000]


def leapc_packet(hands: int) -> bytes:
    bone = struct.pack("<3f3ff4f", 0, 200, 0, 0, 200, -30, 15, 0, 0, 0, 1)
    digit = struct.pack("<i", 1) + bone * 4 + struct.pack("<I", 1)
    data = struct.pack("<qI", 1_500_000, hands)
    for number in range(hands):
        data += struct.pack("<IIifQ4f", 5 + number, 0, number, 0.9, 1000, 30, 0.1, 0, 0)
        palm = struct.pack(
            "<20f", 1, 200, 50, 1, 200, 50, 0, 0, 0, 0, -1, 0, 80, 0, 0, -1, *(0,) * 4
        )
        data += palm + digit * 5 + bone
    return data


_BODY = person()
_IMAGE = rows(seen_at(_BODY, np.array([0.0, 0.0, 2.0])))
_FLOOR = (0.0, 0.8, 0.6, 1.0)
CASES: dict[str, tuple[Callable[[], Decoder], list[bytes]]] = {
    "leap+ws": (
        LeapDecoder,
        [json.dumps(both(1)).encode(), json.dumps(HEADER).encode(), device_event(True, True)],
    ),
    "leap": (LeapCDecoder, [leapc_packet(0), leapc_packet(1), leapc_packet(2)]),
    "kinect v1": (
        lambda: KinectDecoder(kinect_v1.SENSOR),
        [v1_packet({1: (2, 5, (0.1, 0.2, 2.0)), 4: (2, 6, (1, 0.2, 3.0))}, _FLOOR)],
    ),
    "kinect v2": (
        lambda: KinectDecoder(kinect_v2.SENSOR),
        [v2_packet({1: (5, (0.1, 0.2, 2.0)), 4: (6, (1, 0.2, 3.0))}, _FLOOR)],
    ),
    "kinect azure": (
        lambda: KinectDecoder(kinect_azure.SENSOR),
        [azure_packet({}, (0, -1, 0)), azure_packet({5: (10.0, 20.0, 2000.0)}, (0, -0.8, 0.6))],
    ),
    "mediapipe": (
        lambda: LandmarkDecoder(hands=True),
        [
            landmarks([rows(_BODY)]),
            landmarks([rows(_BODY)], pose_landmarks=[_IMAGE], image_size=SIZE, ids=[3]),
            landmarks([rows(_BODY)], left_hand_world_landmarks=[[[0.0, 0.0, 0.0]] * 21]),
        ],
    ),
}


def mutated(packet: bytes, rng: random.Random) -> bytes:
    """A packet damaged in one to six places: bits, words, lengths, tokens of JSON."""
    data = bytearray(packet)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(data) + 1)
        kind = rng.randrange(6)
        if kind == 0 and data:
            data[at - 1] ^= 1 << rng.randrange(8)
        elif kind == 1 and len(data) >= 4:
            word = rng.randrange(len(data) // 4) * 4
            struct.pack_into("<I", data, word, rng.choice([*EXTREMES, rng.getrandbits(32)]))
        elif kind == 2 and rng.random() < 0.3:
            del data[at:]
        elif kind == 3 and rng.random() < 0.3:
            del data[at : at + rng.randint(1, 40)]
        elif kind == 4:
            token = rng.choice(TOKENS)
            data[at : at + rng.choice([0, 1, len(token)])] = token
        elif data:
            data[at - 1] = rng.choice(b'0123456789-e."[]{},:tn \x00\xff')
    return bytes(data)


ODD = [None, True, -1, 1e308, float("nan"), float("inf"), 10**400, "x", [], {}, [[]], [1, 2], 0]


def odd(packet: bytes, rng: random.Random) -> bytes:
    """A JSON message of which one to three values are something else, or gone, or twice there."""
    found = json.loads(packet)
    for _ in range(rng.randint(1, 3)):
        inside = found
        while True:
            keys = list(inside) if isinstance(inside, dict) else range(len(inside))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(inside[key], dict | list) and inside[key] and rng.random() < 0.85:
                inside = inside[key]
                continue
            change = rng.randrange(4)
            if change == 0:
                del inside[key]
            elif change == 1 and isinstance(inside, list):
                inside.append(deepcopy(inside[key]))
            else:
                inside[key] = deepcopy(rng.choice(ODD))
            break
    return json.dumps(found).encode()


def damaged(packets: list[bytes], rng: random.Random) -> bytes:
    packet = rng.choice(packets)
    as_json = packet.startswith(b"{") and rng.random() < 0.6
    return odd(packet, rng) if as_json else mutated(packet, rng)


def check(frame: SkeletonFrame, joints: int, arrival: float) -> None:
    seen = frame.confidence > 0
    assert frame.positions.shape == (joints, 3)
    assert (np.isfinite(frame.positions).all(axis=1) == seen).all()
    assert ((frame.confidence >= 0) & (frame.confidence <= 1)).all()
    assert 0 <= frame.performer < 100
    assert arrival - 2.0 <= frame.time <= arrival == frame.arrival
    if frame.rotations is not None:
        turned = frame.rotations[np.isfinite(frame.rotations).all(axis=1)]
        np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_good_packets_are_frames(name: str) -> None:
    make, packets = CASES[name]
    decoder = make()
    frames = [frame for packet in packets for frame in decoder.feed(packet, 0.0)]
    assert frames
    assert decoder.refused == 0


@pytest.mark.parametrize("name", CASES)
def test_damaged_packets_do_no_harm(name: str) -> None:
    make, packets = CASES[name]
    decoder, rng = make(), random.Random(name)
    joints = len(decoder.skeleton.names)
    frames = 0
    for index in range(COUNT):
        for frame in decoder.feed(damaged(packets, rng), 0.01 * index):
            check(frame, joints, 0.01 * index)
            frames += 1
    assert frames > COUNT // 10
    assert decoder.refused > COUNT // 50
    (frame, *_) = decoder.feed(packets[-1] if name != "leap+ws" else packets[0], 0.01 * COUNT + 60)
    check(frame, joints, 0.01 * COUNT + 60)
    assert (frame.confidence > 0).any()  # the next good packet is as good as ever


@pytest.mark.parametrize("name", CASES)
def test_damaged_packets_leave_nothing_behind(name: str) -> None:
    make, packets = CASES[name]
    decoder, rng = make(), random.Random(name)
    many = [damaged(packets, rng) for _ in range(min(COUNT, 150))]
    for index, data in enumerate(many):
        decoder.feed(data, 0.01 * index)
    tracemalloc.start()
    try:
        for turn in range(2):
            for index, data in enumerate(many):
                decoder.feed(data, 0.01 * index + 10 * turn)
            if turn == 0:
                before = tracemalloc.get_traced_memory()[0]
        assert tracemalloc.get_traced_memory()[0] - before < 50_000
    finally:
        tracemalloc.stop()
