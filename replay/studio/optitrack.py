"""Read tables that OptiTrack's Motive exports: the bones of a skeleton, or markers.

Source: OptiTrack Documentation, "Data Export: CSV".
"""

from __future__ import annotations

import csv
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.bodies.skeleton_on_humanoid import JointOnHumanoid, at
from devices.bodies.t_pose import t_pose_of
from devices.errors import ContentError
from replay.bounds import check_poses
from replay.kinect.text_rows import MOST_LINES
from replay.markers.c3d import UNITS
from replay.markers.marker_body import MarkerMotion, body_of_markers
from replay.recording import Recording
from replay.stage_space import JointMotion, staged
from replay.stated import UNSTATED, Stated
from replay.text_file import file_text

Array = NDArray[np.float64]

_MOST_BYTES = 256 << 20
_MOST_CELLS = 20_000  # of a line
_HEADER_LINES = 16
_USUAL_RATE = 120.0
_TRUNK = {
    "Hip": ("", "Hips", "Hips Pelvis"),
    "Ab": ("Hip", "Spine", "Spine Spine0 Abdomen"),
    "Chest": ("Ab", "Chest", "Spine1 Spine2 Spine3"),
    "Neck": ("Chest", "Neck", "Neck1"),
    "Head": ("Neck", "Head", ""),
}
_LIMBS = {  # parent, humanoid bone, other names
    "Shoulder": ("Chest", "Shoulder", "Collar Clavicle"),
    "UArm": ("Shoulder", "UpperArm", "Arm UpperArm"),
    "FArm": ("UArm", "LowerArm", "ForeArm LowerArm"),
    "Hand": ("FArm", "Hand", ""),
    "Thigh": ("Hip", "UpperLeg", "UpLeg UpperLeg"),
    "Shin": ("Thigh", "LowerLeg", "Leg LowerLeg"),
    "Foot": ("Shin", "Foot", ""),
    "Toe": ("Foot", "Toes", "ToeBase Toes"),
}
_FINGERS = {"Thumb": "Thumb", "Index": "Index", "Middle": "Middle", "Ring": "Ring"}
_FINGERS |= {"Pinky": "Little"}
_SEGMENTS = ("Proximal", "Intermediate", "Distal")


def _bones() -> tuple[dict[str, JointOnHumanoid], dict[str, str]]:
    """Motive's bones on the humanoid, and its name for each name that an export may have."""
    bones: dict[str, JointOnHumanoid] = {}
    names: dict[str, str] = {}
    for bone, (parent, human, others) in _TRUNK.items():
        bones[bone] = at(parent, human)
        names |= dict.fromkeys((bone, *others.split()), bone)
    for letter, side in (("L", "Left"), ("R", "Right")):
        for bone, (parent, human, others) in _LIMBS.items():
            above = parent if parent in _TRUNK else letter + parent
            bones[letter + bone] = at(above, side + human)
            for name in (bone, *others.split()):
                names |= {letter + name: letter + bone, side + name: letter + bone}
        for finger, human in _FINGERS.items():
            above = f"{letter}Hand"
            for number, segment in enumerate(_SEGMENTS, 1):
                own = f"{letter}{finger}{number}"
                bones[own] = at(above, side + human + segment)
                names |= {own: own, f"{side}Hand{finger}{number}": own}
                above = own
    return bones, names


_BONES, _NAMES = _bones()


@dataclass(frozen=True, slots=True)
class _Column:
    """What a column of the table has: of which kind of thing, which, what of it, which axis."""

    kind: str
    name: str
    measure: str
    axis: str


def recognises_optitrack(_path: Path, head: bytes) -> bool:
    """Whether a file begins as Motive's tables do."""
    return head.lstrip(b'\xef\xbb\xbf \t\r\n"').startswith(b"Format Version,")


def read_optitrack(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the skeleton in a table of Motive's, or, where it has none, its markers as a body.

    Positions are those of the joints at which the bones begin; rotations are bone to world.

    Raises:
        InputError: it cannot be read.
        ContentError: it is damaged, local to its parents, or holds neither skeleton nor markers.
    """
    text = file_text(path, _MOST_BYTES)
    if text.count("\n") > MOST_LINES:
        raise ContentError(f"more than {MOST_LINES} lines; split the recording")
    lines = text.split("\n")
    head = [_cells(line) for line in lines[:_HEADER_LINES]]
    said = dict(zip(head[0][::2], head[0][1::2], strict=False))
    if said.get("Coordinate Space", "Global").strip().lower() == "local":
        raise ContentError("its coordinates are local; export it from Motive with global ones")
    start, columns = _columns(head)
    times, table = _table(lines[start:], len(columns), said)
    metres = UNITS.get(said.get("Length Units", "").strip().lower())
    notes: list[str] = []
    bones = _skeleton(columns, notes)
    if len(bones) > 2 and "Hip" in bones:
        if said.get("Rotation Type", "Quaternion").strip().lower() != "quaternion":
            notes.append("rotations are left out: they are no quaternions")
        return staged(_motion(bones, columns, times, table, metres), stated, notes)
    names, places = _points(columns)
    if not names:
        raise ContentError(
            "it holds neither a skeleton nor markers; export them from Motive (File, Export "
            "Tracking Data, with Bones)"
        )
    markers = MarkerMotion(names, times, table[:, places], metres=metres)
    return body_of_markers(markers, stated, notes)


def _cells(line: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line[: 1 << 20]]), [])][:_MOST_CELLS]
    except csv.Error:
        return []


def _columns(head: Sequence[list[str]]) -> tuple[int, list[_Column]]:
    """The number of the first line of numbers, and what the columns are.

    Raises:
        ContentError: the header is of no kind that is known.
    """
    last = next((at for at, row in enumerate(head) if row[:1] == ["Frame"]), None)
    measures = next((at for at, row in enumerate(head) if "Position" in row), None)
    if last is None or measures is None or not 0 < measures < last:
        raise ContentError("it has no header of Motive's; export it again")
    above = [row for row in head[1:measures] if len(row) > 2]
    if len(above) < 2:
        raise ContentError("its columns have no names; export it with its header")
    width = len(head[last])
    kinds, names, what, axes = (
        row + [""] * (width - len(row)) for row in (above[0], above[1], head[measures], head[last])
    )
    return last + 1, [_Column(*each) for each in zip(kinds, names, what, axes, strict=False)]


def _table(lines: Sequence[str], width: int, said: dict[str, str]) -> tuple[Array, Array]:
    """Times (T,) and numbers (T, C); NaN where a cell is empty.

    Raises:
        ContentError: there is no frame, or there are too many.
    """
    numbers = array("d")
    count = 0
    for line in lines:
        cells = line.split(",", width)[:width]
        if len(cells) < 3 or not cells[0].strip().isdecimal():
            continue
        numbers.extend(map(_number, cells))
        numbers.extend([np.nan] * (width - len(cells)))
        count += 1
        if not count % 1024:
            check_poses(count, width // 3 + 1)
    if not count:
        raise ContentError("it holds no frame")
    table = np.frombuffer(numbers).reshape(count, width)
    times: Array = table[:, 1].copy()
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        rate = _number(said.get("Export Frame Rate", ""))
        times = np.arange(count) / (rate if 0.1 < rate < 1e5 else _USUAL_RATE)
    return times, table


def _number(cell: str) -> float:
    try:
        return float(cell) if len(cell) <= 40 else float("nan")
    except ValueError:
        return float("nan")


def _skeleton(columns: Sequence[_Column], notes: list[str]) -> dict[str, str]:
    """The name in the file of each bone of the skeleton that has most of them."""
    found: dict[str, dict[str, str]] = {}
    for column in columns:
        if column.kind == "Bone" and column.measure == "Position":
            subject, separator, plain = column.name.rpartition(":")
            bone = _NAMES.get(plain) if separator else "Hip"  # the root may have the skeleton's
            if bone is not None:
                found.setdefault(subject or plain, {}).setdefault(bone, column.name)
    if not found:
        return {}
    best = max(found, key=lambda subject: len(found[subject]))
    if len(found) > 1:
        others = ", ".join(repr(name[:24]) for name in list(found)[:8] if name != best)
        notes.append(f"skeleton {best[:24]!r}; others are left out: {others}")
    return found[best]


def _points(columns: Sequence[_Column]) -> tuple[list[str], NDArray[np.int64]]:
    """The names of the markers, and the three columns (M, 3) of each."""
    columns_of: dict[str, dict[str, int]] = {}
    for number, column in enumerate(columns):
        if "Marker" in column.kind and column.measure == "Position" and column.axis in "XYZ":
            columns_of.setdefault(column.name, {}).setdefault(column.axis, number)
    whole = {name: places for name, places in columns_of.items() if len(places) == 3}
    places = [[axes[axis] for axis in "XYZ"] for axes in whole.values()]
    return list(whole), np.array(places, dtype=np.int64).reshape(-1, 3)


def _motion(
    bones: dict[str, str],
    columns: Sequence[_Column],
    times: Array,
    table: Array,
    metres: float | None,
) -> JointMotion:
    def track(name: str, measure: str, axes: str) -> Array:
        own: dict[str, int] = {}
        for number, column in enumerate(columns):
            if (column.kind, column.name, column.measure) == ("Bone", name, measure):
                own.setdefault(column.axis, number)
        if not set(axes) <= own.keys():
            return np.full((len(times), len(axes)), np.nan)
        return table[:, [own[axis] for axis in axes]]

    points: dict[str, JointOnHumanoid] = {}
    for bone in _BONES:
        if bone in bones:
            parent = _BONES[bone][0]
            while parent and parent not in points:
                parent = _BONES[parent][0]
            points[bone] = (parent, *_BONES[bone][1:])
    tracks = {bone: track(bones[bone], "Position", "XYZ") for bone in points}
    rotations = np.stack([track(bones[bone], "Rotation", "XYZW") for bone in points], axis=1)
    skeleton = t_pose_of(points, tracks)
    return JointMotion(
        names=skeleton.names,
        parents=skeleton.parents.tolist(),
        rest=skeleton.rest_positions,
        times=times,
        positions=np.stack([tracks[bone] for bone in points], axis=1),
        rotations=rotations if np.isfinite(rotations).any() else None,
        metres=metres,
    )
