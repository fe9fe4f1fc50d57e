"""Read NTU RGB+D .skeleton files: Kinect v2, several bodies per frame.

Source: Shahroudy et al. 2016, "NTU RGB+D"; the layout is that of its read_skeleton_file: number of
frames; each frame a number of bodies; each body a line of identity and hand states, a number of
joints, and for each joint x y z, depth x y, colour x y, orientation w x y z, tracking state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.kinect.joints import KINECT_TO_WORLD, KINECT_V2
from replay.kinect.camera_recording import KINECT_RATE, camera_recording
from replay.kinect.laban import confidence_of_states
from replay.kinect.text_rows import are_numbers, first_rows, read_lines
from replay.recording import Recording

_JOINTS = len(KINECT_V2.names)
_JOINT_FIELDS = 12
_BODY_FIELDS = 10
_LONGEST_COUNT = 20  # characters; Python refuses to convert numbers of thousands
_MOST_BODIES = 6  # tracked at a time by a Kinect v2


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    frame: int
    identity: str
    joints: NDArray[np.float64]  # (25, 12)


def recognises_ntu(path: Path, head: bytes) -> bool:
    """Whether the file begins with the numbers of frames and bodies and a body's ten fields."""
    rows = first_rows(head, None)
    counts = [row[0] for row in rows[:2] if len(row) == 1 and row[0].isdecimal()]
    if len(counts) < 2:
        return False
    if path.suffix.lower() == ".skeleton":
        return True
    return len(rows) > 2 and len(rows[2]) == _BODY_FIELDS and are_numbers(rows[2])


def read_ntu(path: Path) -> Recording:
    """Read an NTU file at 30 frames per second; each body of a frame is a frame of the recording.

    Kinect's 64-bit body identities become performers 0, 1, ... in order of appearance. Rotations
    belong to the bone that ends at the joint; NaN where Kinect gives none.

    Raises:
        InputError: a line does not follow the layout, or there is no body.
    """
    notes: list[str] = ["no times in the file: 30 frames a second (--fps-input N)"]
    bodies = _bodies(path, notes)
    if not bodies:
        raise InputError(f"{path}: holds no body")
    performers: dict[str, int] = {}
    for body in bodies:
        performers.setdefault(body.identity, len(performers))
    if len(performers) > 1:
        notes.append(f"{len(performers)} performers")
    table = np.array([body.joints for body in bodies])
    frames = np.array([body.frame for body in bodies], dtype=np.float64)
    return camera_recording(
        path,
        KINECT_V2,
        KINECT_TO_WORLD,
        times=(frames - frames[0]) / KINECT_RATE,
        positions=table[..., :3],
        confidence=confidence_of_states(path, table[..., 11]),
        performers=np.array([performers[body.identity] for body in bodies], dtype=np.int64),
        rotations=table[..., [8, 9, 10, 7]],
        notes=notes,
    )


def _bodies(path: Path, notes: list[str]) -> list[_Body]:
    """Every body of every whole frame."""
    lines = [(at, line) for at, line in enumerate(read_lines(path), 1) if line.strip()]
    if not lines:
        raise InputError(f"{path}: holds no frame")
    rows = iter(lines)
    declared = _count(path, rows, 10**6)
    bodies: list[_Body] = []
    for frame in range(declared):
        try:
            bodies.extend(_frame(path, rows, frame))
        except StopIteration:
            notes.append(f"declares {declared} frames, holds {frame} whole ones")
            break
        except InputError:
            if next(rows, None) is not None:
                raise
            notes.append(f"declares {declared} frames, holds {frame} whole ones")
            break
    if next(rows, None) is not None:
        notes.append(f"lines after the {declared} declared frames were omitted")
    return bodies


def _frame(path: Path, rows: Iterator[tuple[int, str]], frame: int) -> list[_Body]:
    bodies = []
    for _ in range(_count(path, rows, _MOST_BODIES)):
        identity = _fields(path, rows, _BODY_FIELDS)[0]
        joints = _count(path, rows, _JOINTS)
        table = [[float(f) for f in _fields(path, rows, _JOINT_FIELDS)] for _ in range(joints)]
        if joints != _JOINTS:
            raise InputError(f"{path}: frame {frame + 1} has {joints} joints, expected {_JOINTS}")
        bodies.append(_Body(frame, identity, np.array(table)))
    return bodies


def _count(path: Path, rows: Iterator[tuple[int, str]], most: int) -> int:
    at, line = next(rows)
    if not line.strip().isdecimal() or len(line) > _LONGEST_COUNT or int(line) > most:
        raise InputError(f"{path}, line {at}: expected a count up to {most}, got {line[:60]!r}")
    return int(line)


def _fields(path: Path, rows: Iterator[tuple[int, str]], count: int) -> list[str]:
    at, line = next(rows)
    fields = line.split()
    if len(fields) != count or not are_numbers(fields):
        raise InputError(f"{path}, line {at}: expected {count} numbers, got {line[:60]!r}")
    return fields
