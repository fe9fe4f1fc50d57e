"""What Rokoko Studio, MVN, NI mate and others send, encoded by struct, json, lz4 and python-osc."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence

import lz4.frame
import numpy as np
from pythonosc.osc_message import OscMessage
from scipy.spatial.transform import Rotation

from devices.kinect.joints import KINECT_V2
from devices.osc.openni_joints import OPENNI
from devices.skeleton import Skeleton
from devices.suits.rokoko_bones import SKELETON as ROKOKO
from devices.suits.xsens_segments import xsens_skeleton
from tests.devices.vmc_sender import message

XSENS = xsens_skeleton()
STEP = 1 / 60

# From each maker's axes, as the documents tell them, to ours.
MVN = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # x forward, y left, z up
MVN_Y_UP = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # z right
UNITY = np.diag([-1.0, 1.0, 1.0])
SENSOR = np.diag([-1.0, 1.0, -1.0])  # whoever faces it faces -z

# A body that is not symmetric, so that no mirror image or swap can look right.
LEAN = Rotation.from_euler("zx", [0.2, 0.15])


def posed(skeleton: Skeleton, k: int = 0, *, turn: Rotation = LEAN) -> np.ndarray:
    """A pose (J, 3) [m], another for each `k`, of who leans and has the left forearm raised."""
    places = turn.apply(skeleton.rest_positions.copy())
    raise_by = Rotation.from_euler("z", 1.2 + 0.01 * k)
    for elbow in ("LeftForeArm", "leftLowerArm", "LeftElbow", "ElbowLeft"):
        if elbow in skeleton.names:
            joint = skeleton.index(elbow)
            for other in below(skeleton, joint):
                places[other] = places[joint] + raise_by.apply(places[other] - places[joint])
    return places


def below(skeleton: Skeleton, joint: int) -> list[int]:
    hung = [joint]
    for one in hung:
        hung += np.flatnonzero(skeleton.parents == one).tolist()
    return hung[1:]


# -- Xsens ----------------------------------------------------------------------------------------


def mxtp02(
    positions: np.ndarray,
    rotations: Rotation | None = None,
    *,
    counter: int = 0,
    time_ms: int = 0,
    who: int = 0,
    parts: int = 1,
    ids: Sequence[int] | None = None,
    props: int = 0,
    axes: np.ndarray = MVN,
    kind: bytes = b"MXTP02",
) -> list[bytes]:
    """The datagrams of one sample of a body in our own axes; header of 24 bytes, items of 32."""
    rotations = rotations or Rotation.identity(len(positions))
    ids = ids or range(1, len(positions) + 1)
    theirs = positions @ axes  # of each row r: axes.T @ r
    turned = Rotation.from_matrix(axes.T @ rotations.as_matrix() @ axes).as_quat()
    items = [
        struct.pack(">I3f4f", which, *place, turn[3], *turn[:3])
        for which, place, turn in zip(ids, theirs, turned, strict=True)
    ]
    datagrams = []
    for number, some in enumerate(np.array_split(np.arange(len(items)), parts)):
        payload = b"".join(items[item] for item in some)
        place = number | (0x80 if number == parts - 1 else 0)
        fingers = max(len(positions) - 23 - props, 0)
        datagrams.append(
            struct.pack(">6sIBBI", kind, counter, place, len(some), time_ms)
            + struct.pack(">BBBBHH", who, 23, props, fingers, 0, len(payload))
            + payload
        )
    return datagrams


def mxtp01(positions: np.ndarray, *, counter: int = 0, time_ms: int = 0) -> bytes:
    """Euler angles, which MVN sends with Y up and Z forward, in centimetres."""
    items = b"".join(
        struct.pack(">I3f3f", which, *(100.0 * place), 10.0, 20.0, 30.0)
        for which, place in enumerate(positions, 1)
    )
    head = struct.pack(">6sIBBI", b"MXTP01", counter, 0x80, len(positions), time_ms)
    return head + struct.pack(">BBBBHH", 0, 23, 0, 0, 0, len(items)) + items


def mxtp13() -> bytes:
    """Scale information: names and origins of segments, then points."""
    payload = struct.pack(">I", len(XSENS.names))
    for name, place in zip(XSENS.names, XSENS.rest_positions, strict=True):
        text = name.encode()
        payload += struct.pack(">i", len(text)) + text + struct.pack(">3f", *place)
    payload += struct.pack(">I", 0)
    head = struct.pack(">6sIBBI", b"MXTP13", 0, 0x80, 1, 0)
    return head + struct.pack(">BBBBHH", 0, 23, 0, 0, 0, len(payload)) + payload


# -- Rokoko ---------------------------------------------------------------------------------------


def bones(positions: np.ndarray, rotations: Rotation | None = None) -> dict[str, object]:
    rotations = rotations or Rotation.identity(len(positions))
    turns = Rotation.from_matrix(UNITY @ rotations.as_matrix() @ UNITY).as_quat().tolist()
    return {
        name: {
            "position": dict(zip("xyz", place, strict=True)),
            "rotation": dict(zip("xyzw", turn, strict=True)),
        }
        for name, place, turn in zip(ROKOKO.names, (positions @ UNITY).tolist(), turns, strict=True)
    }


def rokoko_v3(actors: Mapping[str, dict[str, object]], seconds: float = 0.0) -> dict[str, object]:
    return {
        "version": 3,
        "fps": 60,
        "scene": {
            "timestamp": seconds,
            "actors": [
                {
                    "name": name,
                    "color": [255, 0, 0],
                    "meta": {"hasGloves": True, "hasBody": True, "hasFace": False},
                    "dimensions": {"totalHeight": 1.8, "hipHeight": 1.0},
                    "body": body,
                }
                for name, body in actors.items()
            ],
            "props": [{"name": "Box", "type": 0}],
        },
    }


def rokoko_v2(actors: Mapping[str, dict[str, object]], seconds: float = 0.0) -> dict[str, object]:
    return {
        "version": 2,
        "timestamp": seconds,
        "props": [],
        "trackers": [],
        "faces": [],
        "actors": [{"name": name, "id": name, **body} for name, body in actors.items()],
    }


def plain(message: object) -> bytes:
    return json.dumps(message).encode()


def packed(message: object) -> bytes:
    data: bytes = lz4.frame.compress(plain(message))
    return data


# -- NI mate and its kin --------------------------------------------------------------------------

NIMATE = {
    name: name.replace("Left", "Left_").replace("Right", "Right_")
    for name in OPENNI.names
    if name != "Pelvis"
}
OSCELETON = {
    name: theirs.lower().replace("left_", "l_").replace("right_", "r_")
    for name, theirs in NIMATE.items()
}


def nimate(
    positions: np.ndarray,
    rotations: Rotation | None = None,
    *,
    shape: str = "{name}",
    what: str = "both",
    user: int | None = None,
) -> list[OscMessage]:
    """Joints in NI mate's axes; its quaternions take the world to the joint."""
    rotations = rotations or Rotation.identity(len(positions))
    said = []
    for name, theirs in NIMATE.items():
        joint = OPENNI.index(name)
        place = (SENSOR @ positions[joint]).tolist()
        matrix = SENSOR @ rotations[joint].as_matrix() @ SENSOR
        x, y, z, w = Rotation.from_matrix(matrix).inv().as_quat().tolist()
        values = {"both": [*place, w, x, y, z], "place": place, "turn": [w, x, y, z]}[what]
        first = [] if user is None or "{user}" in shape else [user]
        said.append(message(shape.format(name=theirs, user=user), *first, *values))
    return said


def osceleton(
    positions: np.ndarray, user: int = 1, *, mirrored: bool = False, raw: bool = False
) -> list[OscMessage]:
    """OSCeleton's numbers for a body before the sensor, from those of OpenNI [mm]."""
    said = []
    for name, theirs in OSCELETON.items():
        x, y, z = 1000.0 * (SENSOR @ positions[OPENNI.index(name)])
        x = -x if mirrored else x
        normal = ((1280 - x) / 2560, (960 - y) / 1920, z * 7.8125 / 10000)
        said.append(message("/joint", theirs, user, *((x, y, z) if raw else normal)))
    return said


def animata(positions: np.ndarray, user: int = 0, scale: float = 250.0) -> list[OscMessage]:
    """A picture of 250 pixels a metre, y downwards, in which left is to the right or not."""
    return [
        message(
            "/joint",
            f"{theirs}{user}",
            320.0 + scale * positions[OPENNI.index(name)][0],
            240.0 - scale * positions[OPENNI.index(name)][1],
        )
        for name, theirs in OSCELETON.items()
    ]


def kinect2(positions: np.ndarray, body: int = 72057594037928893) -> list[OscMessage]:
    return [
        message(f"/bodies/{body}/joints/{name}", *(SENSOR @ place).tolist())
        for name, place in zip(KINECT_V2.names, positions, strict=True)
    ]


def skelecaster(bodies: Mapping[int, np.ndarray], states: Sequence[int] = (2,) * 25) -> bytes:
    data = bytes([1, 1, 2, len(bodies)])
    for which, positions in bodies.items():
        data += struct.pack("<Q75f25B", which, *(positions @ SENSOR).ravel(), *states)
    return data


SYNC = message("/NI_mate_sync", 1.0)
