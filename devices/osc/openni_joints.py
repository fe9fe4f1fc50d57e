"""Joints of depth-camera programs that send OSC: parse their names, map them to one skeleton.

Received joints are stored as Kinect v2's 25 joints, which include all others: OpenNI's neck, which
lies between the shoulders, is `SpineShoulder`, its torso `SpineMid`, its waist `SpineBase`. The
output skeleton has the 15 joints of OpenNI and the middle of the hips.
"""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_names import Kind, Side, part_of_name
from devices.bodies.skeleton_on_humanoid import JointOnHumanoid, at, skeleton_on_humanoid
from devices.kinect.joints import KINECT_V2

LONGEST_NAME = 128

_HALF_OF_HAND = 0.5
_POINTS: dict[str, JointOnHumanoid] = {
    "Pelvis": ("", "Hips", "Spine", -0.75),
    "Torso": at("Pelvis", "Chest"),
    "Neck": ("Torso", "UpperChest", "Neck", 0.65),
    "Head": at("Neck", "Head"),
}
for _side in ("Left", "Right"):
    _POINTS |= {
        f"{_side}Shoulder": at("Neck", f"{_side}UpperArm"),
        f"{_side}Elbow": at(f"{_side}Shoulder", f"{_side}LowerArm"),
        f"{_side}Hand": (
            f"{_side}Elbow",
            f"{_side}Hand",
            f"{_side}MiddleProximal",
            _HALF_OF_HAND,
        ),
        f"{_side}Hip": at("Pelvis", f"{_side}UpperLeg"),
        f"{_side}Knee": at(f"{_side}Hip", f"{_side}LowerLeg"),
        f"{_side}Foot": at(f"{_side}Knee", f"{_side}Foot"),
    }

OPENNI = skeleton_on_humanoid(_POINTS)
"""16 joints in a T-pose."""

# Kinect's joint for each of OpenNI's, and the joint that replaces it where it was not seen.
_FROM_KINECT = {
    "Pelvis": ("SpineBase", "SpineBase"),
    "Torso": ("SpineMid", "SpineMid"),
    "Neck": ("SpineShoulder", "Neck"),
    "Head": ("Head", "Head"),
    **{
        ours + joint: (first + ours, second + ours)
        for ours in ("Left", "Right")
        for joint, first, second in (
            ("Shoulder", "Shoulder", "Shoulder"),
            ("Elbow", "Elbow", "Elbow"),
            ("Hand", "Hand", "Wrist"),
            ("Hip", "Hip", "Hip"),
            ("Knee", "Knee", "Knee"),
            ("Foot", "Ankle", "Foot"),
        )
    },
}
_FIRST, _SECOND = (
    np.array([KINECT_V2.index(_FROM_KINECT[name][choice]) for name in OPENNI.names])
    for choice in (0, 1)
)

_CENTRE = {
    Kind.HIPS: "SpineBase",
    Kind.SPINE: "SpineMid",
    Kind.CHEST: "SpineMid",
    Kind.NECK: "SpineShoulder",
    Kind.HEAD: "Head",
}
_SIDED = {
    Kind.SHOULDER: "Shoulder",
    Kind.UPPER_ARM: "Shoulder",
    Kind.LOWER_ARM: "Elbow",
    Kind.HAND: "Hand",
    Kind.HIPS: "Hip",
    Kind.UPPER_LEG: "Hip",
    Kind.LOWER_LEG: "Knee",
    Kind.FOOT: "Foot",
}
_WORDS = {"wrist": "Wrist", "ankle": "Ankle", "fingertip": "HandTip", "thumb": "Thumb"}
_WAIST = "waist"
_AROUND = re.compile(r"skeleton|joints?|/", re.IGNORECASE)  # text around a joint's name
_COLLARS = {"collar", "clavicle", "collarbone"}


def openni_choice(seen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the Kinect joint of each OpenNI joint (16,), given which joints (25,) were seen."""
    chosen: NDArray[np.int64] = np.where(seen[_FIRST], _FIRST, _SECOND)
    return chosen


@lru_cache(maxsize=4096)
def joint_called(name: str) -> int | None:
    """Return the index in KINECT_V2 of the joint that a name or address refers to, or None."""
    if len(name) > LONGEST_NAME:
        return None
    part = part_of_name(_AROUND.sub("_", name).strip("_"))
    if part is None or part.word in _COLLARS:
        return None
    if part.side is Side.CENTRE:
        joint = "SpineBase" if part.word == _WAIST else _CENTRE.get(part.kind)
    else:
        point = _WORDS.get(part.word, None if part.tip else _SIDED.get(part.kind))
        joint = point and point + part.side.value.capitalize()
    return None if joint is None else KINECT_V2.index(joint)


@lru_cache(maxsize=4096)
def number_in(name: str) -> int:
    """Return the last number in a name or address, the user's number; 0 if there is none."""
    numbers = re.findall(r"[0-9]+", name[-LONGEST_NAME:])
    return int(numbers[-1][:19]) if numbers else 0
