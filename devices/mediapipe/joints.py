"""The joints of MediaPipe's pose and hand landmarks, connected as one tree.

MediaPipe has no pelvis, spine or neck: the joints "mid_hip" and "mid_shoulder" are added between
the two sides. Of the face, nose, eyes and ears are kept. Landmarks have x to the right of the
image, y down and z away from the camera; the performer faces the camera, so (x, -y, -z) is our
right-handed frame with +Y up, the performer facing +Z and their left at +X. World landmarks are
metres from the middle of the hips.
Source: MediaPipe Solutions, pose and hand landmarker guides.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.skeleton import Skeleton

Array = NDArray[np.float64]

LANDMARK_TO_WORLD = np.diag([1.0, -1.0, -1.0])
LANDMARK_TO_WORLD.setflags(write=False)

POSE_LANDMARKS = (
    "nose left_eye_inner left_eye left_eye_outer right_eye_inner right_eye right_eye_outer "
    "left_ear right_ear mouth_left mouth_right left_shoulder right_shoulder left_elbow right_elbow "
    "left_wrist right_wrist left_pinky right_pinky left_index right_index left_thumb right_thumb "
    "left_hip right_hip left_knee right_knee left_ankle right_ankle left_heel right_heel "
    "left_foot_index right_foot_index"
).split()
HAND_LANDMARKS = (
    "wrist thumb_cmc thumb_mcp thumb_ip thumb_tip index_finger_mcp index_finger_pip "
    "index_finger_dip index_finger_tip middle_finger_mcp middle_finger_pip middle_finger_dip "
    "middle_finger_tip ring_finger_mcp ring_finger_pip ring_finger_dip ring_finger_tip pinky_mcp "
    "pinky_pip pinky_dip pinky_tip"
).split()
SIDES = ("left", "right")
MIDDLES = {
    "mid_hip": ("left_hip", "right_hip"),
    "mid_shoulder": ("left_shoulder", "right_shoulder"),
}
ROOT = "middle"  # joins the parts where no body does

_BODY: dict[str, str | None] = {"mid_hip": None, "mid_shoulder": "mid_hip", "nose": "mid_shoulder"}
for _side in SIDES:
    _BODY |= {
        f"{_side}_{joint}": parent if parent in _BODY else f"{_side}_{parent}"
        for joint, parent in (
            ("eye", "nose"),
            ("ear", "eye"),
            ("shoulder", "mid_shoulder"),
            ("elbow", "shoulder"),
            ("wrist", "elbow"),
            ("thumb", "wrist"),
            ("index", "wrist"),
            ("pinky", "wrist"),
            ("hip", "mid_hip"),
            ("knee", "hip"),
            ("ankle", "knee"),
            ("heel", "ankle"),
            ("foot_index", "ankle"),
        )
    }
# Landmarks of a hand run outwards finger by finger, four each; each finger begins at the wrist.
HAND_BONES = {
    name: HAND_LANDMARKS[0] if index % 4 == 1 else HAND_LANDMARKS[index - 1]
    for index, name in enumerate(HAND_LANDMARKS)
    if index > 0
}
PARENTS: Mapping[str, str | None] = _BODY | {
    f"{side}_{name}": f"{side}_{parent}" for side in SIDES for name, parent in HAND_BONES.items()
}

# [m] the left side of a standing person with half-lowered arms; the right is its mirror image.
_REST = {
    "mid_hip": (0.0, 0.0, 0.0),
    "mid_shoulder": (0.0, 0.48, 0.0),
    "nose": (0.0, 0.64, 0.10),
    "eye": (0.03, 0.68, 0.08),
    "ear": (0.075, 0.66, 0.0),
    "shoulder": (0.18, 0.48, 0.0),
    "elbow": (0.36, 0.28, 0.0),
    "wrist": (0.53, 0.09, 0.02),
    "thumb": (0.55, 0.05, 0.06),
    "index": (0.59, 0.02, 0.04),
    "pinky": (0.58, 0.01, -0.02),
    "hip": (0.10, 0.0, 0.0),
    "knee": (0.11, -0.42, 0.02),
    "ankle": (0.11, -0.84, 0.0),
    "heel": (0.11, -0.90, -0.05),
    "foot_index": (0.13, -0.90, 0.14),
}
# Of each finger: degrees towards the thumb, [m] to its first joint, [m] between its joints.
_FINGER_REST = (
    (30.0, 0.035, 0.030),
    (12.0, 0.090, 0.030),
    (2.0, 0.090, 0.033),
    (-8.0, 0.085, 0.030),
    (-20.0, 0.080, 0.023),
)


def landmarks_to_world(landmarks: ArrayLike) -> Array:
    """Convert landmarks (..., 3) [m] from MediaPipe's axes to our right-handed frame, +Y up."""
    return np.asarray(landmarks, dtype=np.float64) @ LANDMARK_TO_WORLD.T


def landmark_skeleton(present: Iterable[str]) -> Skeleton:
    """Return the skeleton of the joints of `PARENTS` that are `present`, in the tree's order.

    The parent of a joint is its nearest ancestor among them. If several joints have none, a root
    called "middle" joins them.
    """
    given = set(present)
    names = [name for name in PARENTS if name in given]
    parents = {name: _ancestor(name, given) for name in names}
    rest = np.array([_rest(name) for name in names])
    if sum(parent is None for parent in parents.values()) > 1:
        roots = [parents[name] is None for name in names]
        rest = np.concatenate([rest[roots].mean(axis=0, keepdims=True), rest])
        parents = {ROOT: None} | {name: parent or ROOT for name, parent in parents.items()}
        names = [ROOT, *names]
    indices = [-1 if (parent := parents[name]) is None else names.index(parent) for name in names]
    return Skeleton(tuple(names), np.array(indices, dtype=np.int64), rest - rest[indices.index(-1)])


def _ancestor(name: str, given: set[str]) -> str | None:
    parent = PARENTS[name]
    while parent is not None and parent not in given:
        parent = PARENTS[parent]
    return parent


def _rest(name: str) -> Array:
    side, _, bare = name.partition("_")
    if name in _REST:
        return np.array(_REST[name])
    mirror = np.array([-1.0 if side == "right" else 1.0, 1.0, 1.0])
    if bare in _REST:
        return mirror * _REST[bare]
    finger, joint = divmod(HAND_LANDMARKS.index(bare) - 1, 4)
    degrees, first, step = _FINGER_REST[finger]
    angle = np.radians(degrees)
    along = np.array([0.66, -0.75, 0.0])  # on from the forearm
    direction = np.cos(angle) * along + np.sin(angle) * np.array([0.0, 0.0, 1.0])
    place: Array = mirror * (np.array(_REST["wrist"]) + (first + joint * step) * direction)
    return place
