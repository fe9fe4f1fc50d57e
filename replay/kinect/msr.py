"""Read MSR Action3D skeleton files: Kinect v1, 20 lines of "x y z confidence" per frame, metres.

Source: Li, Zhang, Liu 2010, "Action Recognition Based on a Bag of 3D Points"; the files in
real-world coordinates. The joints have an order of their own, not that of the Kinect SDK. It was
derived from the poses: the moving arm of the one-armed actions, performed with the right arm, is
2-9-11-13 counted from 1, and feet are nearer to the camera than ankles.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from devices.kinect.joints import KINECT_TO_WORLD, KINECT_V1
from replay.kinect.camera_recording import camera_recording
from replay.kinect.text_rows import are_numbers, first_rows, number_rows, read_lines
from replay.recording import Recording

_ORDER = (
    *("ShoulderLeft", "ShoulderRight", "ShoulderCenter", "Spine", "HipLeft", "HipRight"),
    *("HipCenter", "ElbowLeft", "ElbowRight", "WristLeft", "WristRight", "HandLeft", "HandRight"),
    *("KneeLeft", "KneeRight", "AnkleLeft", "AnkleRight", "FootLeft", "FootRight", "Head"),
)
_RATE = 15.0  # [Hz] of the data set; its files have no time


def recognises_msr(_path: Path, head: bytes) -> bool:
    """Whether the file has lines of four numbers, the last a confidence."""
    rows = first_rows(head, None)
    return len(rows) >= len(_ORDER) and all(
        len(row) == 4 and are_numbers(row) and 0 <= float(row[3]) <= 1 for row in rows
    )


def read_msr(path: Path) -> Recording:
    """Read every frame of an MSR Action3D file at 15 frames per second.

    The file's confidence is the visibility of the joint: 0 marks a joint that the tracker inferred,
    as it always does along the spine. It maps to 0.5, the usual confidence of inferred joints; 1
    maps to 1.

    Raises:
        InputError: see `number_rows`.
    """
    notes: list[str] = ["no times in the file: 15 frames a second (--fps-input N)"]
    rows = number_rows(path, read_lines(path), 4, notes)
    joints = len(_ORDER)
    frames = len(rows) // joints
    if len(rows) % joints:
        notes.append("the last frame is truncated and was omitted")
    table = rows[: frames * joints].reshape(frames, joints, 4)
    table = table[:, [_ORDER.index(name) for name in KINECT_V1.names]]
    visible = np.clip(np.nan_to_num(table[..., 3]), 0.0, 1.0)
    return camera_recording(
        path,
        KINECT_V1,
        KINECT_TO_WORLD,
        times=np.arange(frames, dtype=np.float64) / _RATE,
        positions=table[..., :3],
        confidence=0.5 + 0.5 * visible,
        notes=notes,
    )
