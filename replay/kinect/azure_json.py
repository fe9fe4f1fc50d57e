"""Read the JSON of Azure Kinect's offline processor: all bodies of a film, with time stamps.

Source: microsoft/Azure-Kinect-Samples, body-tracking-samples/offline_processor. Positions [mm] in
the depth camera's space, Y down; quaternions (w, x, y, z); times [us].
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.kinect.joints import AZURE_TO_WORLD, KINECT_AZURE
from replay.kinect.camera_recording import KINECT_RATE, camera_recording, rising
from replay.kinect.joint_columns import joint_of_name
from replay.recording import Recording
from replay.text_file import file_text

Array = NDArray[np.float64]

_LEVELS = (0.0, 0.5, 1.0, 1.0)  # confidence of k4abt's levels: none, low, medium, high
_SURE = ("confidence_levels", "joint_confidence_levels", "joint_confidences", "confidences")


def recognises_azure_json(_path: Path, head: bytes) -> bool:
    """Whether JSON names bodies with joint positions, as the offline processor does."""
    return head.lstrip()[:1] == b"{" and all(
        name in head for name in (b'"frames"', b'"bodies"', b'"joint_positions"')
    )


def read_azure_json(path: Path) -> Recording:
    """Read every body of every frame; body ids become performers in order of appearance.

    Raises:
        InputError: the file is not such JSON, is cut off, or holds no body.
    """
    try:
        document = parse_json(file_text(path))
        frames = document["frames"]
        order = _order(document.get("joint_names"))
        bodies = [
            (place, frame, body) for place, frame in enumerate(frames) for body in frame["bodies"]
        ]
        table = np.array([_numbers(body["joint_positions"], 3, order) for *_, body in bodies])
        turns = np.array(
            [_numbers(body.get("joint_orientations"), 4, order) for *_, body in bodies]
        )
        sure = np.array([_confidence(body, order) for *_, body in bodies])
        stamps = np.array([_stamp(place, frame) for place, frame, _ in bodies])
        ids = [str(body.get("body_id", 0)) for *_, body in bodies]
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError) as error:
        raise InputError(
            f"{path}: not the JSON of an offline processor, or cut off ({type(error).__name__})"
        ) from error
    if not bodies:
        raise InputError(f"{path}: holds no body")
    notes: list[str] = []
    known = {body: number for number, body in enumerate(dict.fromkeys(ids))}
    if len(known) > 1:
        notes.append(f"{len(known)} performers")
    return camera_recording(
        path,
        KINECT_AZURE,
        AZURE_TO_WORLD,
        times=rising(path, stamps, notes),
        positions=table / 1000.0,
        confidence=sure,
        performers=np.array([known[body] for body in ids], dtype=np.int64),
        rotations=np.nan_to_num(turns)[..., [1, 2, 3, 0]],
        notes=notes,
    )


def _stamp(place: int, frame: Mapping[str, Any]) -> float:
    """The time of a frame [s]."""
    given = frame.get("timestamp_usec")
    return float(given) * 1e-6 if given is not None else place / KINECT_RATE


def _order(names: Any) -> list[int]:
    """The place in the file of each joint of `KINECT_AZURE`; -1 for those that it does not name."""
    if not isinstance(names, list) or not names:
        return list(range(len(KINECT_AZURE.names)))
    places = {joint_of_name(KINECT_AZURE, str(name)): place for place, name in enumerate(names)}
    return [places.get(joint, -1) for joint in range(len(KINECT_AZURE.names))]


def _numbers(rows: Any, width: int, order: Sequence[int]) -> Array:
    """The rows (J, width) of all joints, NaN where there is none."""
    found = np.full((len(order), width), np.nan)
    for joint, place in enumerate(order):
        if rows is not None and 0 <= place < len(rows) and len(rows[place]) == width:
            found[joint] = [math.nan if value is None else float(value) for value in rows[place]]
    return found


def _confidence(body: Mapping[str, Any], order: Sequence[int]) -> Array:
    levels = next((body[name] for name in _SURE if name in body), None)
    if not isinstance(levels, list):
        return np.ones(len(order))
    given = [int(levels[place]) if 0 <= place < len(levels) else 0 for place in order]
    return np.array([_LEVELS[min(max(level, 0), len(_LEVELS) - 1)] for level in given])
