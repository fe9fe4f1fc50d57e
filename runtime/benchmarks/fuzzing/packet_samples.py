"""Small valid packets of each protocol for the fuzzer."""

from __future__ import annotations

import json
import struct

import numpy as np

from devices.bodies.humanoid import humanoid_skeleton
from devices.bridge.messages import (
    LATEST,
    Answer,
    Call,
    encode_announcement,
    encode_answer,
    encode_call,
    encode_face,
    encode_sample,
)
from devices.osc.messages import write_bundles, write_message
from devices.skeleton import Skeleton, SkeletonFrame
from devices.suits.rokoko_bones import SKELETON as ROKOKO
from devices.suits.xsens_segments import xsens_skeleton
from runtime.benchmarks.fuzzing.file_samples import leap_message, person
from runtime.benchmarks.fuzzing.kinect_packets import azure_packet, v1_packet, v2_packet

_AHEAD, _FLOOR = (0.1, 0.2, 2.0), (0.0, 1.0, 0.0, 0.9)
_PLACE = (0.1, 1.0, 0.2, 0.0, 0.0, 0.0, 1.0)


def packet_samples() -> dict[str, list[bytes]]:
    """Packets by protocol."""
    return {
        "vmc": _vmc(),
        "vrchat": _vrchat(),
        "nimate": _nimate(),
        "leap": [json.dumps(leap_message(k)).encode() for k in range(2)],
        "mediapipe": [json.dumps({"pose_world_landmarks": [person()], "ids": [3]}).encode()],
        "rokoko": _rokoko(),
        "xsens": _xsens(),
        "bridge": _bridge(),
        "Kinect v1": [v1_packet({1: (2, 7, _AHEAD), 3: (1, 8, _AHEAD)}, _FLOOR)],
        "Kinect v2": [v2_packet({0: (7, _AHEAD), 2: (8, _AHEAD)}, _FLOOR)],
        "Azure Kinect": [azure_packet({1: (0.1, 0.2, 2000.0), 2: (500, 0, 2500)}, (0, -1, 0))],
    }


def _bundled(messages: list[bytes]) -> list[bytes]:
    return [*write_bundles(messages, 60_000), messages[0], messages[-1]]


def _vmc() -> list[bytes]:
    bones = [
        write_message("/VMC/Ext/Bone/Pos", "s" + "f" * 7, name, *_PLACE)
        for name in humanoid_skeleton().names
    ]
    said = [
        write_message("/VMC/Ext/OK", "i", 1),
        write_message("/VMC/Ext/T", "f", 1.5),
        write_message("/VMC/Ext/Root/Pos", "s" + "f" * 7, "root", *_PLACE),
        write_message("/VMC/Ext/Blend/Val", "sf", "Joy", 0.5),
        write_message("/VMC/Ext/Blend/Apply"),
        write_message("/VMC/Ext/Tra/Pos", "s" + "f" * 7, "LHR-1", *_PLACE),
    ]
    return [*_bundled([*said, *bones]), *_bundled(said)]


def _vrchat() -> list[bytes]:
    return _bundled(
        [
            write_message(f"/tracking/trackers/{which}/{what}", "fff", 0.1, 1.0, 0.2)
            for which in ("head", *range(1, 9))
            for what in ("position", "rotation")
        ]
    )


def _nimate() -> list[bytes]:
    names = ("Head", "Neck", "Torso", "Left_Shoulder", "Left_Elbow", "Left_Hand", "Right_Hand")
    return [
        *_bundled([write_message(f"/{name}", "f" * 7, *_PLACE) for name in names]),
        *_bundled(
            [write_message("/joint", "sifff", name.lower(), 1, 0.5, 0.5, 0.5) for name in names]
        ),
        write_message("/skeleton", "f" * 45, *([0.5, 1.0, 2.0] * 15)),
        write_message("/lost_user", "i", 1),
        json.dumps({"bodies": [{"id": 1, "joints": [[0.1, 1.0, 2.0]] * 25}]}).encode(),
    ]


def _rokoko() -> list[bytes]:
    bone = {"position": {"x": 0, "y": 1, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    body = dict.fromkeys(ROKOKO.names, bone)
    actor = {"name": "A", "meta": {"hasFace": True}, "body": body, "face": {"jawOpen": 50}}
    return [
        json.dumps({"version": 3, "scene": {"timestamp": 1.0, "actors": [actor]}}).encode(),
        json.dumps({"version": 2, "timestamp": 1.0, "actors": [{"name": "A", **body}]}).encode(),
    ]


def _xsens() -> list[bytes]:
    places = xsens_skeleton().rest_positions
    items = b"".join(
        struct.pack(">I3f4f", number, z, x, y, 1.0, 0.0, 0.0, 0.0)
        for number, (x, y, z) in enumerate(places.tolist(), 1)
    )
    head = struct.pack(">6sIBBI", b"MXTP02", 7, 0x80, len(places), 17)
    return [head + struct.pack(">BBBBHH", 0, 23, 0, 0, 0, len(items)) + items]


def _bridge() -> list[bytes]:
    skeleton = Skeleton(("root", "hand"), np.array([-1, 0]), np.eye(3)[:2])
    frame = SkeletonFrame(1.0, np.eye(3)[:2], np.eye(4)[:2], np.ones(2), arrival=1.0)
    return [
        encode_call(Call(5, 6, 7, 1.0, 8, LATEST)),
        encode_answer(Answer(6, 7, 1.0, 1.1, 1.2)),
        encode_announcement(6, skeleton),
        encode_sample(6, 8, frame),
        encode_face(6, 8, {"jawOpen": 0.5}),
    ]
