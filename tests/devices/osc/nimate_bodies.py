"""Bodies of the built-in skeleton, and a decoder that is fed their messages."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pythonosc.osc_message import OscMessage
from scipy.spatial.transform import Rotation

from devices.kinect.joints import KINECT_V2
from devices.osc.nimate import NimateDecoder
from devices.osc.openni_joints import OPENNI
from devices.skeleton import SkeletonFrame
from tests.devices.sender_packets import STEP, nimate, osceleton, posed
from tests.devices.vmc_sender import bundle, message

TORSO = np.linalg.norm(
    OPENNI.rest_positions[OPENNI.index("Neck")] - OPENNI.rest_positions[OPENNI.index("Pelvis")]
)
TURNS = Rotation.from_euler("yx", np.linspace(0.1, 1.0, 32).reshape(16, 2))
FAR = np.array([0.4, -0.3, -2.5])  # before the sensor, which stands higher than the hips


def joint(name: str) -> int:
    return OPENNI.index(name)


def body(k: int = 0) -> np.ndarray:
    """A pose whose pelvis is the middle of its hips, as the programs that have none leave it."""
    places = posed(OPENNI, k)
    places[joint("Pelvis")] = (places[joint("LeftHip")] + places[joint("RightHip")]) / 2.0
    return places


def standing(places: np.ndarray) -> np.ndarray:
    """On the floor, with the torso of the built-in body."""
    torso = np.linalg.norm(places[joint("Neck")] - places[joint("Pelvis")])
    return (places - (0.0, places[:, 1].min(), 0.0)) * TORSO / torso


def fed(
    decoder: NimateDecoder, frames: Sequence[Sequence[OscMessage]], *, bundled: bool = True
) -> list[SkeletonFrame]:
    """What a decoder makes of frames that come one after another, 60 a second."""
    made: list[SkeletonFrame] = []
    for k, said in enumerate(frames):
        datagrams = [bundle(said)] if bundled else [one.dgram for one in said]
        for n, data in enumerate(datagrams):
            made += decoder.feed(data, 10.0 + k * STEP + n * 1e-5)
    return made


Say = Callable[[np.ndarray], list[OscMessage]]
WAYS: dict[str, Say] = {
    "basic": lambda p: nimate(p, what="place"),
    "basic and orientation": lambda p: nimate(p, TURNS),
    "with a slash": lambda p: nimate(p, shape="/skeleton_{name}"),
    "ten units a metre": lambda p: nimate(10.0 * p, what="place"),
    "millimetres": lambda p: nimate(1000.0 * p, what="place"),
    "OSCeleton": osceleton,
    "OSCeleton, mirrored": lambda p: osceleton(p, mirrored=True),
    "OSCeleton, raw": lambda p: osceleton(p, raw=True),
    "OSCeleton, for Quartz Composer": lambda p: [
        message(f"/joint/{one.params[0]}/{one.params[1]}", *one.params[2:]) for one in osceleton(p)
    ],
}


def kinect_body(k: int = 0) -> np.ndarray:
    return posed(KINECT_V2, k) + FAR
