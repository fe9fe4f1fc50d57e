"""Reads Kinect tables whose columns or rows name the joints, as many small programs write them.

A row for each frame: columns such as SpineBase_X, or, as Kinect-2-CSV has it, a line of joint names
and a line of X;Y;Z under each; stamps perhaps once a row or before each joint. Or a row for each
joint: columns such as Timestamp, JointID, Position.X, Position.Y, Position.Z, State. Kinect v1, v2
and Azure; camera metres, or millimetres.
Source: LightBuzz Kinect-2-CSV and its descendants; DumpKinectSkeleton.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.kinect.joints import (
    AZURE_TO_WORLD,
    KINECT_AZURE,
    KINECT_TO_WORLD,
    KINECT_V1,
    KINECT_V2,
)
from devices.skeleton import Skeleton
from replay.kinect.camera_recording import KINECT_RATE, camera_recording, rising
from replay.recording import Recording
from replay.stamps import count_frames, units_per_second
from replay.text_file import file_text

Array = NDArray[np.float64]

_KINECTS = (
    ("Kinect v2", KINECT_V2, KINECT_TO_WORLD),
    ("Azure Kinect", KINECT_AZURE, AZURE_TO_WORLD),
    ("Kinect v1", KINECT_V1, KINECT_TO_WORLD),
)
_MOST_BYTES = 128 << 20
_ENOUGH = 8  # joints that make a table one of a Kinect
_MILLIMETRES_FROM = 50.0  # units of distance from which the unit cannot be metres
_STATES = {"nottracked": 0.0, "inferred": 0.5, "tracked": 1.0, "0": 0.0, "1": 0.5, "2": 1.0}
_AXES = {"x": 0, "y": 1, "z": 2}
_STAMPS = ("timestamp", "time", "timestampms", "times", "ticks", "milliseconds", "timems", "t")
_SMALLER = {"timestampms": 1e3, "milliseconds": 1e3, "timems": 1e3, "ticks": 1e7}
_BODIES = ("bodyid", "trackingid", "bodyindex", "body", "userid", "skeletonid")
_JOINT_COLUMNS = ("jointid", "joint", "jointtype", "jointname", "jointindex")
_STATE_COLUMNS = ("state", "trackingstate", "jointtrackingstate")
_COLUMN = re.compile(
    r"^(?P<joint>.+?)(?:position|pos|camera|world)?(?P<axis>[xyz]|state|trackingstate)$"
)


@dataclass(slots=True)
class _Frame:
    """One body at one moment: places and confidence of its joints (J, 4)."""

    stamp: float
    body: str
    joints: Array


def joint_of_name(skeleton: Skeleton, name: str) -> int | None:
    """The joint that a name means, however it is spelled: "SPINE_NAVEL", "Left Hand"; or None."""
    plain = _plain(name)
    spelled = {_plain(joint): index for index, joint in enumerate(skeleton.names)}
    for side in ("left", "right"):  # "LeftHand" for "HandLeft"
        spelled |= {
            side + joint.removesuffix(side): index
            for joint, index in list(spelled.items())
            if joint.endswith(side)
        }
    return spelled.get(plain)


def recognises_joint_columns(_path: Path, head: bytes) -> bool:
    """Whether the first lines name the joints of a Kinect, in columns or in rows."""
    lines = head.decode("utf-8", errors="replace").splitlines()[:64]
    if len(lines) < 2 or "\ufffd" in lines[0] or lines[0][:1] in ("{", "["):
        return False
    rows = [_cells(line, lines[0]) for line in lines]
    return _by_frames(rows) is not None or _by_joints(rows) is not None


def read_joint_columns(path: Path) -> Recording:
    """Read every body of a table that names its joints.

    Raises:
        InputError: the file cannot be read, or holds no frame.
    """
    lines = [line for line in file_text(path, _MOST_BYTES).split("\n") if line.strip()]
    rows = [_cells(line, lines[0]) for line in lines]
    layout = _by_frames(rows) or _by_joints(rows)
    if layout is None:
        raise InputError(f"{path}: its first lines name no joints of a Kinect")
    notes: list[str] = []
    frames = layout.frames(rows)
    if not frames:
        raise InputError(f"{path}: holds no frame")
    table = np.array([frame.joints for frame in frames])
    away = np.abs(table[..., 2][np.isfinite(table[..., 2])])
    if away.size and np.median(away) > _MILLIMETRES_FROM:
        notes.append("unit guessed: millimetres")
        table[..., :3] /= 1000.0
    ids = list(dict.fromkeys(frame.body for frame in frames))
    if len(ids) > 1:
        notes.append(f"{len(ids)} performers")
    return camera_recording(
        path,
        layout.skeleton,
        layout.camera_to_world,
        times=_times(path, np.array([frame.stamp for frame in frames]), layout.second, notes),
        positions=table[..., :3],
        confidence=np.nan_to_num(table[..., 3]),
        performers=np.array([ids.index(frame.body) for frame in frames], dtype=np.int64),
        notes=notes,
    )


def _times(path: Path, stamps: Array, second: float | None, notes: list[str]) -> Array:
    """Times (T,) [s] from stamps of a perhaps unknown unit; 30 frames a second without any."""
    if np.isfinite(stamps).all() and not (second is None and count_frames(stamps)):
        return rising(path, stamps / (second or units_per_second(stamps, None, notes)), notes)
    notes.append(f"no times in the file: {KINECT_RATE:.0f} frames a second (--fps-input N)")
    return np.arange(len(stamps), dtype=np.float64) / KINECT_RATE


@dataclass(slots=True)
class _Layout:
    """Where a table has what; columns are None where it has none.

    Attributes:
        skeleton: of the sensor.
        camera_to_world: (3, 3) of the sensor.
        header: number of lines before the first frame.
        stamp: column of the time.
        body: column of the body.
        second: units of the stamp in a second, None if unknown.
        places: joint and axis (3 is the state) of each column, in a table with a row a frame.
        joint: column of the joint, in a table with a row a joint.
    """

    skeleton: Skeleton
    camera_to_world: Array
    header: int
    stamp: int | None
    body: int | None
    second: float | None
    places: dict[int, tuple[int, int]]
    joint: int | None = None

    def frames(self, rows: Sequence[Sequence[str]]) -> list[_Frame]:
        """The frames of all rows; those of another length are left out."""
        body = rows[self.header :]
        return self._one_a_joint(body) if self.joint is not None else self._one_a_frame(body)

    def _blank(self) -> Array:
        joints = np.full((len(self.skeleton.names), 4), np.nan)
        joints[:, 3] = 0.0
        return joints

    def _one_a_frame(self, rows: Sequence[Sequence[str]]) -> list[_Frame]:
        used = sorted({joint for joint, _ in self.places.values()})
        order = list(dict.fromkeys(joint for joint, _ in self.places.values()))
        frames = []
        for row in rows:
            joints, stamp = self._blank(), _number(row, self.stamp)
            if len(row) == 4 * len(order) and len(row) > len(self.places) + 1:
                numbers = np.array([_number(row, at) for at in range(len(row))]).reshape(-1, 4)
                joints[order, :3], stamp = numbers[:, 1:], numbers[0, 0]  # a stamp before each
            else:
                for column, (joint, axis) in self.places.items():
                    joints[joint, axis] = _state(row, column) if axis == 3 else _number(row, column)
            seen = np.isfinite(joints[used, :3]).all(axis=1)
            if seen.any():
                stated = 3 in {axis for _, axis in self.places.values()}
                joints[used, 3] = np.where(seen, joints[used, 3] if stated else 1.0, 0.0)
                frames.append(_Frame(stamp, _cell(row, self.body), joints))
        return frames

    def _one_a_joint(self, rows: Sequence[Sequence[str]]) -> list[_Frame]:
        frames: list[_Frame] = []
        now: dict[str, _Frame] = {}
        for row in rows:
            joint = _joint(self.skeleton, _cell(row, self.joint))
            if joint is None:
                continue
            body, stamp = _cell(row, self.body), _number(row, self.stamp)
            frame = now.get(body)
            if frame is None or frame.stamp != stamp or np.isfinite(frame.joints[joint, 0]):
                frame = now[body] = _Frame(stamp, body, self._blank())
                frames.append(frame)
            frame.joints[joint, 3] = 1.0
            for column, (_, axis) in self.places.items():
                frame.joints[joint, axis] = (
                    _state(row, column) if axis == 3 else _number(row, column)
                )
        return frames


def _by_frames(rows: Sequence[Sequence[str]]) -> _Layout | None:
    """The layout of a table with a row for each frame, or None."""
    for _, skeleton, to_world in sorted(_KINECTS, key=lambda kinect: -_named(rows[0], kinect[1])):
        if len(rows) > 1 and {"x", "y", "z"} <= {_plain(cell)[-1:] for cell in rows[1]}:
            places, header = _under_names(rows, skeleton), 2
        else:
            places, header = _in_names(rows[0], skeleton), 1
        if len({joint for joint, _ in places.values()}) >= _ENOUGH:
            stamp, second = _stamp_column(rows[0])
            body = _column(rows[0], _BODIES)
            return _Layout(skeleton, to_world, header, stamp, body, second, places)
    return None


def _by_joints(rows: Sequence[Sequence[str]]) -> _Layout | None:
    """The layout of a table with a row for each joint, or None."""
    names = [_plain(cell) for cell in rows[0]]
    joint = _column(rows[0], _JOINT_COLUMNS)
    axes: dict[int, tuple[int, int]] = {}
    for axis, number in _AXES.items():
        column = _column(rows[0], (f"position{axis}", f"pos{axis}", f"camera{axis}", axis))
        if column is not None:
            axes[column] = (0, number)
    if joint is None or len(axes) < 3:
        return None
    state = next((names.index(name) for name in _STATE_COLUMNS if name in names), None)
    if state is not None:
        axes[state] = (0, 3)
    told = [_cell(row, joint) for row in rows[1:]]
    stamp, second = _stamp_column(rows[0])
    body = _column(rows[0], _BODIES)
    for _, skeleton, to_world in _KINECTS:
        found = {_joint(skeleton, name) for name in told}
        enough = min(_ENOUGH, len(set(told)))
        if None not in found and len(found) >= enough > 3:
            return _Layout(skeleton, to_world, 1, stamp, body, second, axes, joint)
    return None


def _under_names(rows: Sequence[Sequence[str]], skeleton: Skeleton) -> dict[int, tuple[int, int]]:
    """Joint and axis of each column: names in the first line, X, Y, Z under them in the second."""
    named = [joint_of_name(skeleton, name) for name in rows[0] if name.strip()]
    joints = [joint for joint in named if joint is not None]
    places: dict[int, tuple[int, int]] = {}
    at = -1
    for column, cell in enumerate(rows[1]):
        axis = _AXES.get(_plain(cell).removeprefix("position")[:1])
        if axis is None or "orientation" in _plain(cell):
            continue
        at += axis == 0
        if 0 <= at < len(joints):
            places[column] = joints[at], axis
    return places


def _in_names(header: Sequence[str], skeleton: Skeleton) -> dict[int, tuple[int, int]]:
    """Joint and axis of each column, both in its name: SpineBase_X, HandLeft.Position.Y."""
    places: dict[int, tuple[int, int]] = {}
    for column, cell in enumerate(header):
        if (match := _COLUMN.match(_plain(cell))) is None:
            continue
        joint = joint_of_name(skeleton, match["joint"])
        axis = _AXES.get(match["axis"], 3)
        if joint is not None and (joint, axis) not in places.values():
            places[column] = joint, axis
    return places


def _named(header: Sequence[str], skeleton: Skeleton) -> int:
    """How many joints of a skeleton a line names."""
    whole = {joint_of_name(skeleton, cell) for cell in header}
    return len((whole | {joint for joint, _ in _in_names(header, skeleton).values()}) - {None})


def _joint(skeleton: Skeleton, text: str) -> int | None:
    """The joint that a name or a number of the SDK means."""
    if text.strip().isdecimal():
        number = int(text) if len(text) < 4 else len(skeleton.names)
        return number if number < len(skeleton.names) else None
    return joint_of_name(skeleton, text)


def _stamp_column(header: Sequence[str]) -> tuple[int | None, float | None]:
    column = _column(header, _STAMPS)
    return column, None if column is None else _SMALLER.get(_plain(header[column]))


def _column(header: Sequence[str], names: Sequence[str]) -> int | None:
    plain = [_plain(cell) for cell in header]
    return next((plain.index(name) for name in names if name in plain), None)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _cells(line: str, first: str) -> list[str]:
    """The fields of a line; the line itself says what parts them, if the first one does not."""
    separator = max(";\t,", key=line.count) if line.count(";") else max("\t,", key=first.count)
    cells = next(csv.reader([line], delimiter=separator), [])
    return cells[:-1] if cells and not cells[-1].strip() else cells


def _cell(row: Sequence[str], column: int | None) -> str:
    return row[column] if column is not None and column < len(row) else ""


def _number(row: Sequence[str], column: int | None) -> float:
    try:
        return float(_cell(row, column).replace(",", "."))
    except ValueError:
        return float("nan")


def _state(row: Sequence[str], column: int) -> float:
    return _STATES.get(_plain(_cell(row, column)), 1.0)
