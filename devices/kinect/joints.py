"""The joints of the three Kinects: names and order of each SDK, parents, and a rest pose.

Source: Kinect for Windows SDK 1.8 (NUI_SKELETON_POSITION_INDEX), SDK 2.0 (JointType), Azure Kinect
Body Tracking SDK 1.1 (k4abt_joint_id_t). The rest pose is a standing body 1.75 m tall whose arms
hang a little away from it; metres, +Y up, facing +Z, left on +X.
"""

from __future__ import annotations

import numpy as np

from devices.skeleton import Skeleton

# Of each joint: its name, its parent, and its position at rest [m].
_Joints = tuple[tuple[str, str, float, float, float], ...]

_V1: _Joints = (
    ("HipCenter", "", 0.0, 0.95, 0.0),
    ("Spine", "HipCenter", 0.0, 1.05, -0.02),
    ("ShoulderCenter", "Spine", 0.0, 1.42, -0.02),
    ("Head", "ShoulderCenter", 0.0, 1.62, 0.02),
    ("ShoulderLeft", "ShoulderCenter", 0.18, 1.36, -0.02),
    ("ElbowLeft", "ShoulderLeft", 0.26, 1.10, -0.03),
    ("WristLeft", "ElbowLeft", 0.32, 0.87, 0.01),
    ("HandLeft", "WristLeft", 0.34, 0.80, 0.03),
    ("ShoulderRight", "ShoulderCenter", -0.18, 1.36, -0.02),
    ("ElbowRight", "ShoulderRight", -0.26, 1.10, -0.03),
    ("WristRight", "ElbowRight", -0.32, 0.87, 0.01),
    ("HandRight", "WristRight", -0.34, 0.80, 0.03),
    ("HipLeft", "HipCenter", 0.09, 0.89, 0.0),
    ("KneeLeft", "HipLeft", 0.11, 0.49, 0.01),
    ("AnkleLeft", "KneeLeft", 0.12, 0.09, -0.03),
    ("FootLeft", "AnkleLeft", 0.13, 0.03, 0.10),
    ("HipRight", "HipCenter", -0.09, 0.89, 0.0),
    ("KneeRight", "HipRight", -0.11, 0.49, 0.01),
    ("AnkleRight", "KneeRight", -0.12, 0.09, -0.03),
    ("FootRight", "AnkleRight", -0.13, 0.03, 0.10),
)

_V2: _Joints = (
    ("SpineBase", "", 0.0, 0.95, 0.0),
    ("SpineMid", "SpineBase", 0.0, 1.20, -0.02),
    ("Neck", "SpineShoulder", 0.0, 1.50, -0.02),
    ("Head", "Neck", 0.0, 1.64, 0.02),
    ("ShoulderLeft", "SpineShoulder", 0.18, 1.36, -0.02),
    ("ElbowLeft", "ShoulderLeft", 0.26, 1.10, -0.03),
    ("WristLeft", "ElbowLeft", 0.32, 0.87, 0.01),
    ("HandLeft", "WristLeft", 0.34, 0.80, 0.03),
    ("ShoulderRight", "SpineShoulder", -0.18, 1.36, -0.02),
    ("ElbowRight", "ShoulderRight", -0.26, 1.10, -0.03),
    ("WristRight", "ElbowRight", -0.32, 0.87, 0.01),
    ("HandRight", "WristRight", -0.34, 0.80, 0.03),
    ("HipLeft", "SpineBase", 0.09, 0.91, 0.0),
    ("KneeLeft", "HipLeft", 0.11, 0.50, 0.01),
    ("AnkleLeft", "KneeLeft", 0.12, 0.09, -0.03),
    ("FootLeft", "AnkleLeft", 0.13, 0.03, 0.10),
    ("HipRight", "SpineBase", -0.09, 0.91, 0.0),
    ("KneeRight", "HipRight", -0.11, 0.50, 0.01),
    ("AnkleRight", "KneeRight", -0.12, 0.09, -0.03),
    ("FootRight", "AnkleRight", -0.13, 0.03, 0.10),
    ("SpineShoulder", "SpineMid", 0.0, 1.43, -0.03),
    ("HandTipLeft", "HandLeft", 0.35, 0.72, 0.05),
    ("ThumbLeft", "WristLeft", 0.31, 0.80, 0.07),
    ("HandTipRight", "HandRight", -0.35, 0.72, 0.05),
    ("ThumbRight", "WristRight", -0.31, 0.80, 0.07),
)

_AZURE: _Joints = (
    ("Pelvis", "", 0.0, 0.96, 0.0),
    ("SpineNavel", "Pelvis", 0.0, 1.13, -0.01),
    ("SpineChest", "SpineNavel", 0.0, 1.27, -0.03),
    ("Neck", "SpineChest", 0.0, 1.49, -0.03),
    ("ClavicleLeft", "SpineChest", 0.03, 1.45, -0.02),
    ("ShoulderLeft", "ClavicleLeft", 0.18, 1.40, -0.02),
    ("ElbowLeft", "ShoulderLeft", 0.26, 1.12, -0.03),
    ("WristLeft", "ElbowLeft", 0.32, 0.89, 0.01),
    ("HandLeft", "WristLeft", 0.34, 0.81, 0.03),
    ("HandTipLeft", "HandLeft", 0.35, 0.72, 0.05),
    ("ThumbLeft", "WristLeft", 0.31, 0.81, 0.07),
    ("ClavicleRight", "SpineChest", -0.03, 1.45, -0.02),
    ("ShoulderRight", "ClavicleRight", -0.18, 1.40, -0.02),
    ("ElbowRight", "ShoulderRight", -0.26, 1.12, -0.03),
    ("WristRight", "ElbowRight", -0.32, 0.89, 0.01),
    ("HandRight", "WristRight", -0.34, 0.81, 0.03),
    ("HandTipRight", "HandRight", -0.35, 0.72, 0.05),
    ("ThumbRight", "WristRight", -0.31, 0.81, 0.07),
    ("HipLeft", "Pelvis", 0.09, 0.96, 0.0),
    ("KneeLeft", "HipLeft", 0.10, 0.53, 0.01),
    ("AnkleLeft", "KneeLeft", 0.11, 0.11, -0.03),
    ("FootLeft", "AnkleLeft", 0.12, 0.03, 0.11),
    ("HipRight", "Pelvis", -0.09, 0.96, 0.0),
    ("KneeRight", "HipRight", -0.10, 0.53, 0.01),
    ("AnkleRight", "KneeRight", -0.11, 0.11, -0.03),
    ("FootRight", "AnkleRight", -0.12, 0.03, 0.11),
    ("Head", "Neck", 0.0, 1.57, 0.0),
    ("Nose", "Head", 0.0, 1.61, 0.12),
    ("EyeLeft", "Head", 0.03, 1.64, 0.09),
    ("EarLeft", "Head", 0.08, 1.62, 0.01),
    ("EyeRight", "Head", -0.03, 1.64, 0.09),
    ("EarRight", "Head", -0.08, 1.62, 0.01),
)


def _skeleton(joints: _Joints) -> Skeleton:
    names = tuple(name for name, *_ in joints)
    parents = [names.index(parent) if parent else -1 for _, parent, *_ in joints]
    return Skeleton(names, parents, [place for _, _, *place in joints])  # type: ignore[arg-type]  # the unpacked rest of a row is three numbers


KINECT_V1 = _skeleton(_V1)
KINECT_V2 = _skeleton(_V2)
KINECT_AZURE = _skeleton(_AZURE)

# Camera axes to ours, with the performer facing the sensor. Kinect v1 and v2 have +X to the
# sensor's left, +Y up and +Z away from it (half a turn about Y); Azure has +Y down (half a turn
# about X).
KINECT_TO_WORLD = np.diag([-1.0, 1.0, -1.0])
AZURE_TO_WORLD = np.diag([1.0, -1.0, -1.0])

# Kinect SDK 2.0 TrackingState, also JointTrackingState of 1.8: not tracked, inferred, tracked.
CONFIDENCE_OF_STATE = np.array([0.0, 0.5, 1.0])
