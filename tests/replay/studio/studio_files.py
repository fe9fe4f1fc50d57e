"""Small files of studios' programs, of bodies whose joints are known."""

from __future__ import annotations

import json

import numpy as np
from scipy.spatial.transform import Rotation

from devices.suits.xsens_segments import xsens_skeleton
from tests.replay.markers.marked_bodies import joints_of

MOTIVE = {
    "Head": "Head",
    "Neck": "Neck",
    "Chest": "UpperChest",
    **{
        letter + own: side + bone
        for letter, side in (("L", "Left"), ("R", "Right"))
        for own, bone in (
            ("Thigh", "UpperLeg"),
            ("Shin", "LowerLeg"),
            ("Foot", "Foot"),
            ("Toe", "Toes"),
            ("UArm", "UpperArm"),
            ("FArm", "LowerArm"),
            ("Hand", "Hand"),
        )
    },
}
"""Motive's bones by the joints of `joints_of`."""


def motive_table(
    things: dict[str, np.ndarray], kind: str, *, prefix: str = "Anna:", unit: str = "Meters"
) -> str:
    """A table as Motive exports it, of bones or markers (T, 3) [m] at 120 frames a second."""
    factor = {"Meters": 1.0, "Millimeters": 1000.0, "Centimeters": 100.0}[unit]
    turned = kind == "Bone"
    measures = ["Rotation"] * 4 * turned + ["Position"] * 3
    axes = ["X", "Y", "Z", "W"] * turned + ["X", "Y", "Z"]
    names = [prefix + name for name in things for _ in axes]
    frames = len(next(iter(things.values())))
    rows = [
        "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,120.000000,Export Frame Rate,"
        f"120.000000,Rotation Type,Quaternion,Length Units,{unit},Coordinate Space,Global",
        "",
        ",Type," + ",".join([kind] * len(names)),
        ",Name," + ",".join(names),
        ",ID," + ",".join(["4F"] * len(names)),
        ",," + ",".join(measures * len(things)),
        "Frame,Time (Seconds)," + ",".join(axes * len(things)),
    ]
    for frame in range(frames):
        cells: list[str] = [str(frame), f"{frame / 120:.6f}"]
        for track in things.values():
            cells += ["0", "0", "0", "1"] * turned
            cells += ["" if np.isnan(x) else f"{x * factor:.6f}" for x in track[frame]]
        rows.append(",".join(cells))
    return "\n".join([*rows, ""])


def motive_bones() -> dict[str, np.ndarray]:
    """The bones of the walking body, the hips between the thighs."""
    joints = joints_of()
    bones = {"Hip": (joints["LeftUpperLeg"] + joints["RightUpperLeg"]) / 2}
    return bones | {own: joints[joint] for own, joint in MOTIVE.items()}


ASF = """# AST/ASF file
:version 1.10
:name VICON
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  made by hand
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name lfemur
     direction 0.34202014 -0.93969262 0
     length 7
     axis 0 0 20  XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 2
     name ltibia
     direction 0.34202014 -0.93969262 0
     length 7
     axis 0 0 20  XYZ
    dof rx
  end
  begin
     id 3
     name lfoot
     direction 0 -0.2 0.98
     length 2
     axis -90 0 20 XYZ
    dof rx rz
  end
  begin
     id 4
     name rfemur
     direction -0.34202014 -0.93969262 0
     length 7
     axis 0 0 -20  XYZ
    dof rx ry rz
  end
  begin
     id 5
     name rtibia
     direction -0.34202014 -0.93969262 0
     length 7
     axis 0 0 -20  XYZ
    dof rx
  end
  begin
     id 6
     name rfoot
     direction 0 -0.2 0.98
     length 2
     axis -90 0 -20 XYZ
    dof rx rz
  end
  begin
     id 7
     name thorax
     direction 0 1 0
     length 8
     axis 0 0 0 XYZ
    dof rx ry rz
  end
  begin
     id 8
     name head
     direction 0 1 0
     length 4
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root lfemur rfemur thorax
    lfemur ltibia
    ltibia lfoot
    rfemur rtibia
    rtibia rfoot
    thorax head
  end
"""
AMC = """#!OML:ASF F:\\VICON\\USERDATA\\01\\01.ASF
:FULLY-SPECIFIED
:DEGREES
1
root 0 15 0 0 0 0
lfemur 0 0 0
ltibia 0
lfoot 0 0
rfemur 0 0 0
rtibia 0
rfoot 0 0
thorax 0 0 0
2
root 1 15 2 10 20 30
lfemur -30 10 5
ltibia 40
lfoot 5 -3
rfemur -90 0 0
rtibia 90
rfoot 0 0
thorax 5 6 7
"""


def amc_by_hand(rows: dict[str, list[float]]) -> dict[str, np.ndarray]:
    """Where the bones of `ASF` end, in its unit, by SciPy's rotations: G = P C M C^-1."""
    bones = {
        "lfemur": ("root", [0.34202014, -0.93969262, 0], 7, [0, 0, 20]),
        "ltibia": ("lfemur", [0.34202014, -0.93969262, 0], 7, [0, 0, 20]),
        "lfoot": ("ltibia", [0, -0.2, 0.98], 2, [-90, 0, 20]),
        "rfemur": ("root", [-0.34202014, -0.93969262, 0], 7, [0, 0, -20]),
        "rtibia": ("rfemur", [-0.34202014, -0.93969262, 0], 7, [0, 0, -20]),
        "thorax": ("root", [0, 1, 0], 8, [0, 0, 0]),
    }
    channels = {"lfoot": (0, 2), "ltibia": (0,), "rtibia": (0,)}
    turns = {"root": Rotation.from_euler("xyz", rows["root"][3:], degrees=True)}
    ends = {"root": np.array(rows["root"][:3])}
    for name, (parent, direction, length, axis) in bones.items():
        angles = np.zeros(3)
        angles[list(channels.get(name, (0, 1, 2)))] = rows[name]
        frame = Rotation.from_euler("xyz", axis, degrees=True)
        own = frame * Rotation.from_euler("xyz", angles, degrees=True) * frame.inv()
        turns[name] = turns[parent] * own
        ends[name] = ends[parent] + turns[name].apply(np.array(direction) * length)
    return ends


def mvnx_text(frames: int = 5, *, step: float = 0.1, position: bool = True) -> str:
    """A file of MVN of the suit's body, +Z up, +X ahead; it goes ahead and turns its head."""
    body = xsens_skeleton()
    rest = body.rest_positions[:, [2, 0, 1]]  # ours is +Y up and looks along +Z
    rows = []
    for frame in range(frames):
        places = rest + np.array([step * frame, 0.0, 0.0])
        turns = np.tile([1.0, 0, 0, 0], (len(body.names), 1))
        angle = 0.2 * frame
        turns[body.index("Head")] = [np.cos(angle / 2), 0, 0, np.sin(angle / 2)]
        what = f"<orientation>{_words(turns)}</orientation>"
        what += f"<position>{_words(places)}</position>" * position
        rows.append(f'<frame time="{frame}" index="{frame}" type="normal">{what}</frame>')
    segments = "".join(f'<segment label="{n}" id="{k}"/>' for k, n in enumerate(body.names, 1))
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<mvnx version="4"><mvn version="2023"/>'
        f'<subject label="Anna" frameRate="240" segmentCount="{len(body.names)}">'
        f"<segments>{segments}</segments><frames>"
        '<frame type="tpose"><orientation>1 0 0 0</orientation><position>9 9 9</position></frame>'
        f"{''.join(rows)}</frames></subject></mvnx>\n"
    )


def _words(values: np.ndarray) -> str:
    return " ".join(f"{value:.6f}" for value in values.ravel())


BODY_25 = {
    "Nose": (0, 170), "Neck": (0, 140), "RShoulder": (-18, 140), "RElbow": (-45, 140),
    "RWrist": (-70, 140), "LShoulder": (18, 140), "LElbow": (45, 140), "LWrist": (70, 140),
    "MidHip": (0, 94), "RHip": (-9, 94), "RKnee": (-9, 49), "RAnkle": (-9, 8), "LHip": (9, 94),
    "LKnee": (9, 49), "LAnkle": (9, 8), "REye": (-3, 174), "LEye": (3, 174), "REar": (-8, 172),
    "LEar": (8, 172), "LBigToe": (10, 1), "LSmallToe": (13, 1), "LHeel": (9, 2),
    "RBigToe": (-10, 1), "RSmallToe": (-13, 1), "RHeel": (-9, 2),
}  # fmt: skip
"""A person of 25 points [cm], y up, who faces the camera."""


def openpose_json(
    *people: tuple[float, dict[str, tuple[float, float]]], coco: bool = False
) -> bytes:
    """A frame of OpenPose: each person shifted sideways [cm], with points moved; 4 pixels a cm."""
    found = []
    for shift, moved in people:
        points = BODY_25 | moved
        names = [n for n in BODY_25 if not coco or (n in list(BODY_25)[:19] and n != "MidHip")]
        numbers: list[float] = []
        for name in names:
            x, y = points[name]
            numbers += [4 * (x + shift) + 960, 1000 - 4 * y, 0.8] if y else [0, 0, 0]
        found.append({"person_id": [-1], "pose_keypoints_2d": numbers})
    return json.dumps({"version": 1.3, "people": found}).encode()
