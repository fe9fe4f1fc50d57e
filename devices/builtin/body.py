"""Skeleton of the built-in performer: Kinect v2's joints, with hands that have fingers.

The body is 1.72 m tall. At rest its arms hang 45 degrees away from it with the palms to the front,
so that no two limbs point in the same direction. Metres, +Y up, facing +Z, left on +X.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton

Array = NDArray[np.float64]

# (joint, parent, offset from the parent); the right limbs are mirror images of these left ones
_TRUNK = (
    ("SpineBase", "", (0.0, 0.93, 0.0)),
    ("SpineMid", "SpineBase", (0.0, 0.24, -0.01)),
    ("SpineShoulder", "SpineMid", (0.0, 0.24, -0.01)),
    ("Neck", "SpineShoulder", (0.0, 0.08, 0.01)),
    ("Head", "Neck", (0.0, 0.15, 0.02)),
)
_LIMBS = (
    ("Shoulder", "SpineShoulder", (0.18, -0.04, 0.0)),
    ("Elbow", "Shoulder", (0.20, -0.20, -0.01)),
    ("Wrist", "Elbow", (0.185, -0.165, 0.03)),
    ("Hand", "Wrist", (0.058, -0.052, 0.010)),
    ("Hip", "SpineBase", (0.09, -0.04, 0.0)),
    ("Knee", "Hip", (0.035, -0.415, 0.015)),
    ("Ankle", "Knee", (0.025, -0.405, -0.025)),
    ("Foot", "Ankle", (0.025, -0.065, 0.13)),
)
SIDES = ("Left", "Right")
SOLE = 0.03
"""Height [m] of the foot joints above the floor at rest."""
FINGERS = ("Thumb", "Index", "Middle", "Ring", "Little")
_SPREAD = np.radians([52.0, 17.0, 2.0, -13.0, -29.0])  # from the hand's direction, thumb side up
_REACH = (0.030, 0.046, 0.046, 0.043, 0.040)  # [m] from the middle of the palm to the knuckle
_LENGTHS = {
    "Thumb": (0.034, 0.028),
    "Index": (0.042, 0.025, 0.022),
    "Middle": (0.046, 0.029, 0.023),
    "Ring": (0.043, 0.027, 0.023),
    "Little": (0.034, 0.021, 0.020),
}
_BONES = {2: ("Proximal", "Distal", "Tip"), 3: ("Proximal", "Intermediate", "Distal", "Tip")}


def finger_joints(side: str, finger: str) -> tuple[str, ...]:
    """Return the joints of one finger from knuckle to tip, e.g. ("LeftIndexProximal", ...)."""
    return tuple(f"{side}{finger}{bone}" for bone in _BONES[len(_LENGTHS[finger])])


def finger_direction(finger: str) -> Array:
    """Return the rest direction of a finger of the left hand: a unit vector (3,)."""
    angle = np.arctan2(-0.052, 0.058) + _SPREAD[FINGERS.index(finger)]
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def builtin_skeleton() -> Skeleton:
    """Return the 59 joints, standing on y = 0, with 3 cm of foot below the foot joints."""
    joints: list[tuple[str, str, Array]] = [
        (name, parent, np.array(offset)) for name, parent, offset in _TRUNK
    ]
    trunk = {name for name, *_ in _TRUNK}
    for side, flip in zip(SIDES, (1.0, -1.0), strict=True):
        mirror = np.array([flip, 1.0, 1.0])
        for name, parent, offset in _LIMBS:
            above = parent if parent in trunk else parent + side
            joints.append((name + side, above, np.array(offset) * mirror))
        for finger, reach in zip(FINGERS, _REACH, strict=True):
            above = f"Hand{side}"
            steps = (reach, *_LENGTHS[finger])
            for name, step in zip(finger_joints(side, finger), steps, strict=True):
                joints.append((name, above, step * finger_direction(finger) * mirror))
                above = name
    names = tuple(name for name, *_ in joints)
    parents = np.array([names.index(parent) if parent else -1 for _, parent, _ in joints])
    places = np.zeros((len(joints), 3))
    for joint, (_, _, moved) in enumerate(joints):
        places[joint] = moved + (places[parents[joint]] if parents[joint] >= 0 else 0.0)
    feet = [names.index(f"Foot{side}") for side in SIDES]
    places[:, 1] += SOLE - places[feet, 1].min()
    return Skeleton(names, parents, places)
