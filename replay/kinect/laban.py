"""Read Kinect v2 CSV files of the Labanotation Suite: ticks and 25 joints with states per line.

Source: microsoft/LabanotationSuite, KinectReader. Camera metres, joints in the order of SDK 2.0,
ticks of 100 ns, no header, a comma after the last field.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.kinect.joints import CONFIDENCE_OF_STATE, KINECT_TO_WORLD, KINECT_V2
from replay.kinect.camera_recording import camera_recording, rising
from replay.kinect.text_rows import are_numbers, first_rows, number_rows, read_lines
from replay.recording import Recording

_COLUMNS = 1 + 4 * len(KINECT_V2.names)
_TICK = 1e-7  # [s]


def recognises_laban(_path: Path, head: bytes) -> bool:
    """Whether the file has lines of 101 numbers separated by commas."""
    rows = first_rows(head, ",")
    return bool(rows) and all(
        len(row) in (_COLUMNS, _COLUMNS + 1)
        and not "".join(row[_COLUMNS:]).strip()
        and are_numbers(row[:_COLUMNS])
        for row in rows
    )


def read_laban(path: Path) -> Recording:
    """Read a Labanotation Suite CSV; tracked joints have confidence 1, inferred ones 0.5.

    Raises:
        InputError: see `number_rows`, or a tracking state is invalid.
    """
    notes: list[str] = []
    rows = number_rows(path, read_lines(path), _COLUMNS, notes, separator=",")
    joints = rows[:, 1:].reshape(len(rows), -1, 4)
    return camera_recording(
        path,
        KINECT_V2,
        KINECT_TO_WORLD,
        times=rising(path, rows[:, 0] * _TICK, notes),
        positions=joints[..., :3],
        confidence=confidence_of_states(path, joints[..., 3]),
        notes=notes,
    )


def confidence_of_states(path: Path, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the confidence of Kinect's tracking states, any shape.

    Raises:
        InputError: a number is not a state.
    """
    known = np.isin(states, np.arange(len(CONFIDENCE_OF_STATE)))
    if not known.all():
        raise InputError(f"{path}: tracking state {states[~known][0]:g} is none of 0, 1, 2")
    confidence: NDArray[np.float64] = CONFIDENCE_OF_STATE[states.astype(np.int64)]
    return confidence
