"""Read UTKinect-Action3D skeleton files: Kinect v1, a frame number and 20 joints per line.

Source: Xia, Chen, Aggarwal 2012, "View Invariant Human Action Recognition Using Histograms of 3D
Joints". Camera metres, joints in the order of the Kinect SDK.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.kinect.joints import KINECT_TO_WORLD, KINECT_V1
from replay.kinect.camera_recording import KINECT_RATE, camera_recording, rising
from replay.kinect.text_rows import are_numbers, first_rows, number_rows, read_lines
from replay.recording import Recording

_COLUMNS = 1 + 3 * len(KINECT_V1.names)


def recognises_ut(_path: Path, head: bytes) -> bool:
    """Whether the file has lines of 61 numbers, the first an integer."""
    rows = first_rows(head, None)
    return bool(rows) and all(
        len(row) == _COLUMNS and row[0].isdecimal() and are_numbers(row) for row in rows
    )


def read_ut(path: Path) -> Recording:
    """Read a UTKinect file; its clock is the frame number, with gaps, at 30 per second.

    Some numbers stand on two lines with different poses: these are separate captures, spaced evenly
    within the frame. A line that equals the one before it is omitted.

    Raises:
        InputError: see `number_rows`.
    """
    notes: list[str] = []
    rows = number_rows(path, read_lines(path), _COLUMNS, notes)
    fresh = np.concatenate([[True], (np.diff(rows, axis=0) != 0).any(axis=1)])
    if not fresh.all():
        notes.append(f"{np.count_nonzero(~fresh)} lines repeat the one before and were omitted")
        rows = rows[fresh]
    numbers = rising(path, rows[:, 0], notes)
    return camera_recording(
        path,
        KINECT_V1,
        KINECT_TO_WORLD,
        times=(numbers + _within_frame(numbers, notes)) / KINECT_RATE,
        positions=rows[:, 1:].reshape(len(rows), -1, 3),
        confidence=np.ones((len(rows), len(KINECT_V1.names))),
        notes=notes,
    )


def _within_frame(numbers: NDArray[np.float64], notes: list[str]) -> NDArray[np.float64]:
    """Elapsed share (T,) of the frame at each capture: 0 unless the number repeats."""
    _, start, count = np.unique(numbers, return_index=True, return_counts=True)
    if (count > 1).any():
        again = int((count - 1).sum())
        notes.append(f"{again} captures share a frame number and were spaced within the frame")
    nth = np.arange(len(numbers)) - np.repeat(start, count)
    share: NDArray[np.float64] = nth / np.repeat(count, count)
    return share
