"""Read the motion of an AMC file (Acclaim) with the ASF file of its skeleton beside it.

A bone turns by its channels in the axes of the ASF file: C M C^-1, each of C and M the rotations
about x, y and z in their order, the first one turned first.
Source: University of Wisconsin, "Acclaim ASF/AMC", and the files of the CMU database.
"""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import ContentError, InputError
from replay.bounds import check_poses, check_recordable
from replay.kinect.text_rows import MOST_LINES
from replay.recording import Recording
from replay.stage_space import JointMotion, staged
from replay.stated import UNSTATED, Stated
from replay.studio.asf import AsfSkeleton, Bone, read_asf
from replay.text_file import file_text
from solvers.skeleton.quaternions import conjugate, multiply, rotate

Array = NDArray[np.float64]

_MOST_BYTES = 256 << 20
_MOST_SKELETON = 4 << 20  # bytes
_MOST_LOOKED_AT = 10_000  # files of a folder
_RATE = 120.0  # of the CMU database
_AXES = "xyz"


def recognises_amc(path: Path, head: bytes) -> bool:
    """Whether a file is a motion or a skeleton of Acclaim's."""
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    lines = head[:2048].split(b"\n")
    return (
        start.startswith((b"#!OML:ASF", b"# AST/ASF", b":FULLY-SPECIFIED"))
        or any(line.strip() == b":FULLY-SPECIFIED" for line in lines)
        or path.suffix.lower() in (".amc", ".asf")
    )


def read_amc(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the motion at `path` on the skeleton that lies beside it.

    The skeleton is the .asf file with the same name, with the name up to the first "_" (01_05.amc
    and 01.asf), the one that the motion names, or the only one in the folder. Rotations are bone to
    world, identity at rest.

    Raises:
        InputError: a file cannot be read, or there is no skeleton.
        ContentError: a file is damaged.
    """
    text = file_text(path, _MOST_BYTES)
    if path.suffix.lower() == ".asf" or ":bonedata" in text[:65536].lower():
        raise ContentError("it is a skeleton without motion; name an .amc file of it")
    if text.count("\n") > MOST_LINES:
        raise ContentError(f"more than {MOST_LINES} lines; split the recording")
    beside = _skeleton_of(path, text)
    try:
        skeleton = read_asf(file_text(beside, _MOST_SKELETON))
    except ContentError as error:
        raise InputError(f"{beside}: {error}") from None
    notes = [f"skeleton of {beside.name}", f"{_RATE:.0f} frames a second (--fps-input N)"]
    channels = _channels(text, skeleton)
    names, parents = _joints(skeleton)
    rest, _ = _posed(skeleton, np.zeros((1, channels.shape[1])))
    positions, rotations = _posed(skeleton, channels)
    return staged(
        JointMotion(
            names=names,
            parents=parents,
            rest=rest[0],
            times=np.arange(len(channels), dtype=np.float64) / _RATE,
            positions=positions,
            rotations=rotations,
            metres=skeleton.metres,
        ),
        stated,
        notes,
    )


def _skeleton_of(path: Path, text: str) -> Path:
    """The ASF file that belongs to a motion.

    Raises:
        InputError: there is none.
    """
    first = text[:1024].partition("\n")[0]
    named = first.removeprefix("#!OML:ASF").strip().replace("\\", "/").rpartition("/")[2]
    wanted = [path.stem, path.stem.partition("_")[0]]
    if first.startswith("#!OML:ASF"):
        wanted.append(Path(named).stem if named else "")
    there: list[Path] = []
    try:
        for number, file in enumerate(path.parent.iterdir()):
            if number > _MOST_LOOKED_AT:
                break
            if file.suffix.lower() == ".asf":
                there.append(file)
    except OSError:
        there = []
    by_stem = {file.stem.lower(): file for file in sorted(there)}
    found = next((by_stem[name.lower()] for name in wanted if name.lower() in by_stem), None)
    if found is None and len(there) == 1:
        found = there[0]
    if found is None:
        raise InputError(
            f"{path}: its skeleton is missing; put its .asf file beside it, such as {wanted[1]}.asf"
        )
    check_recordable(found)
    return found


def _channels(text: str, skeleton: AsfSkeleton) -> Array:
    """The channels (T, C) of all bones, in their order; angles [rad], NaN where not given.

    Raises:
        ContentError: there is no frame, or a line is damaged.
    """
    starts, width = {}, 0
    for bone in skeleton.bones:
        starts[bone.name] = width, len(bone.motion)
        width += len(bone.motion)
    numbers, degrees = array("d"), True
    row: list[float] | None = None
    for number, line in enumerate(text.split("\n"), 1):
        words = line.split()
        if not words or words[0][0] in "#:":
            degrees = degrees and words[:1] != [":RADIANS"]
            continue
        if len(words) == 1 and words[0].isdecimal():
            if row is not None:
                numbers.extend(row)
                check_poses(len(numbers) // max(width, 1), len(skeleton.bones))
            row = [np.nan] * width
            continue
        place = starts.get(words[0])
        if row is None or place is None:
            raise ContentError(f"line {number}: no bone of its skeleton is {words[0][:40]!r}")
        try:
            given = [float(word[:40]) for word in words[1 : 1 + place[1]]]
        except ValueError:
            raise ContentError(f"line {number}: {line.strip()[:40]!r} are no numbers") from None
        row[place[0] : place[0] + len(given)] = given
    if row is not None and np.isfinite(row).all():
        numbers.extend(row)  # the last one, unless it is cut off
    if not width or not numbers:
        raise ContentError("it holds no frame")
    channels = np.frombuffer(numbers).reshape(-1, width).copy()
    turned = [name[0] == "r" for bone in skeleton.bones for name in bone.motion]
    if degrees:
        channels[:, turned] = np.radians(channels[:, turned])
    channels[~(np.abs(channels) < 1e9)] = np.nan
    return channels


def _joints(skeleton: AsfSkeleton) -> tuple[list[str], list[int]]:
    """Names and parents of the joints: where each bone starts, and where the last ones end."""
    bones = skeleton.bones
    names, parents = [bone.name for bone in bones], [bone.parent for bone in bones]
    for number in _ends(bones):
        names.append(f"{bones[number].name}_end")
        parents.append(number)
    return names, parents


def _ends(bones: list[Bone]) -> list[int]:
    inner = {bone.parent for bone in bones}
    return [number for number in range(1, len(bones)) if number not in inner]


def _posed(skeleton: AsfSkeleton, channels: Array) -> tuple[Array, Array]:
    """Positions (T, J, 3) and rotations (T, J, 4) of the joints, in the file's unit and world."""
    bones, count = skeleton.bones, len(channels)
    starts, ends = np.zeros((len(bones), count, 3)), np.zeros((len(bones), count, 3))
    turns = np.zeros((len(bones), count, 4))
    column = 0
    for number, bone in enumerate(bones):
        values = channels[:, column : column + len(bone.motion)]
        column += len(bone.motion)
        turn, move = _moved(bone, values)
        if bone.parent < 0:
            starts[number], turns[number] = skeleton.place + move, turn
        else:
            above = turns[bone.parent]
            starts[number] = ends[bone.parent] + rotate(above, move)
            turns[number] = multiply(above, turn)
        vector = np.broadcast_to(bone.vector, (count, 3))
        ends[number] = starts[number] + rotate(turns[number], vector)
    last = _ends(bones)
    positions = np.concatenate([starts, ends[last]])
    rotations = np.concatenate([turns, turns[last]])
    return positions.transpose(1, 0, 2).copy(), rotations.transpose(1, 0, 2).copy()


def _moved(bone: Bone, values: Array) -> tuple[Array, Array]:
    """The rotation (T, 4) since rest and the translation (T, 3) that a bone's channels give it."""
    count = len(values)
    own, move = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)), np.zeros((count, 3))
    for name, value in zip(bone.motion, values.T, strict=True):
        if len(name) != 2 or name[1] not in _AXES:
            continue  # "l", a change of length
        if name[0] == "r":
            own = multiply(_about(name[1], value), own)
        elif name[0] == "t":
            move[:, _AXES.index(name[1])] = value
    axes = np.array([[0.0, 0.0, 0.0, 1.0]])
    for name, angle in zip(bone.axis_order, bone.axis, strict=True):
        axes = multiply(_about(name, np.array([angle])), axes)
    axes = np.broadcast_to(axes, own.shape)
    return multiply(multiply(axes, own), conjugate(axes)), move


def _about(axis: str, angle: Array) -> Array:
    """Quaternions (T, 4) of rotations about one axis by angles (T,) [rad]."""
    turned = np.zeros((len(angle), 4))
    turned[:, _AXES.index(axis)], turned[:, 3] = np.sin(angle / 2), np.cos(angle / 2)
    return turned
