"""Bounds on a recording's size, times and places, checked before it is used."""

from __future__ import annotations

import stat
from dataclasses import replace
from pathlib import Path

import numpy as np

from devices.errors import InputError
from devices.skeleton import FARTHEST, MOST_SECONDS
from replay.recording import Recording

MOST_POSES = 20_000_000
"""Frames times joints: an hour and a half of one body of 59 joints at 60 Hz; 1 GB while it is read.
"""

MOST_JOINTS = 10_000
FARTHEST_REST = 1000.0
"""[m] from the origin of a joint at rest."""


def check_recordable(path: Path) -> None:
    """Check that a recording can be at `path`: a file, or nothing yet.

    A pipe or a device would wait for ever for somebody at its other end.

    Raises:
        InputError: it is a pipe, a device, a socket or a folder.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a pipe or a device"
        raise InputError(f"{path} is {what}, not a file; give the name of a file")


def check_poses(frames: int, joints: int) -> None:
    """Refuse a recording with more frames, for this number of joints, than are read.

    Raises:
        InputError: there are too many.
    """
    if frames * joints > MOST_POSES:
        raise InputError(
            f"{frames} frames of {joints} joints are too many (more than {MOST_POSES} poses); "
            "split the recording"
        )


@np.errstate(all="ignore")  # numbers of a damaged file
def plausible(recording: Recording) -> Recording:
    """The recording without impossible places; a note says how many there were.

    Raises:
        InputError: its times are beyond `MOST_SECONDS` or not in order, or its skeleton is one that
            no recording of ours can hold.
    """
    rest = recording.skeleton.rest_positions
    if len(rest) > MOST_JOINTS or not (np.abs(rest) <= FARTHEST_REST).all():
        raise InputError(
            f"its skeleton has more than {MOST_JOINTS} joints, or one that rests farther than "
            f"{FARTHEST_REST:g} m away; state its unit (--unit-input)"
        )
    if not (np.diff(recording.times) >= 0.0).all() or not recording.seconds <= MOST_SECONDS:
        raise InputError("its times are no seconds; check how it was written")
    far = ~(np.abs(recording.positions) <= FARTHEST).all(axis=2)
    beyond = far & np.isfinite(recording.positions).all(axis=2)
    if beyond.any():
        positions, confidence = recording.positions.copy(), recording.confidence.copy()
        positions[beyond], confidence[beyond] = np.nan, 0.0
        said = f"{np.count_nonzero(beyond)} places farther than {FARTHEST:g} m away were left out"
        recording = replace(
            recording, positions=positions, confidence=confidence, notes=(*recording.notes, said)
        )
    late = ~(np.abs(recording.arrivals) <= MOST_SECONDS) & np.isfinite(recording.arrivals)
    if late.any():
        recording = replace(recording, arrivals=np.where(late, np.nan, recording.arrivals))
    return recording
