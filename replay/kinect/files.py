"""What the readers of recorded Kinect files share: text to rows, camera space to a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.bodies.joint_labels import hips_joint, label_joints
from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.orientation import floor_and_start, standing_axis, upright, yaw_to_front
from replay.recording import Recording

Array = NDArray[np.float64]

MOST_BYTES = 128 * 2**20
KINECT_RATE = 30.0  # [Hz] of every Kinect's skeleton stream
_STEEPEST = np.cos(np.radians(40))  # a camera tilted by more is no camera on a stand
_STRAY = 0.02  # of all frames, whose lowest joint may be tracked below the floor
_FURTHEST = 100.0  # [m] no Kinect sees so far


def read_lines(path: Path) -> list[str]:
    """All lines of a text file, without a byte order mark.

    Raises:
        InputError: it cannot be read, is too large, or is no text.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"{path}: larger than {MOST_BYTES // 2**20} MiB; split the recording")
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    try:
        return raw.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file, byte {error.start} is no UTF-8") from error


def first_rows(head: bytes, separator: str | None) -> list[list[str]]:
    """The fields of the whole lines in a file's first bytes; [] where these are no text."""
    lines = head.decode("utf-8-sig", errors="replace")
    if "\ufffd" in lines[:-4] or "\x00" in lines:
        return []
    whole = lines.splitlines()[: None if len(head) < 512 or lines.endswith("\n") else -1]
    return [line.split(separator) for line in whole if line.strip()]


def are_numbers(fields: list[str]) -> bool:
    """Whether every field is a number."""
    try:
        return bool([float(field) for field in fields])
    except ValueError:
        return False


def number_rows(
    path: Path, lines: list[str], columns: int, notes: list[str], separator: str | None = None
) -> Array:
    """The lines as numbers (rows, columns); empty lines skipped, a cut last line left out.

    Raises:
        InputError: a line with another number of fields, or something that is no number, or none.
    """
    rows: list[list[float]] = []
    filled = [(at, line) for at, line in enumerate(lines, 1) if line.strip()]
    for place, (at, line) in enumerate(filled):
        fields = line.strip().rstrip(separator).split(separator)
        if len(fields) == columns and are_numbers(fields):
            rows.append([float(field) for field in fields])
        elif rows and place == len(filled) - 1:
            notes.append("the last line is cut and was left out")
        else:
            raise InputError(f"{path}, line {at}: expected {columns} numbers, got {line[:60]!r}")
    if not rows:
        raise InputError(f"{path}: holds no frame")
    return np.array(rows)


def rising(path: Path, times: Array, notes: list[str]) -> Array:
    """Times (T,) [s] from 0 that never fall, whatever the file's clock does.

    Raises:
        InputError: a time that is no finite number.
    """
    if not np.isfinite(times).all() or np.abs(times).max() > 1e12:
        raise InputError(
            f"{path}: frame {int(np.argmin(np.isfinite(times))) + 1} has no usable time"
        )
    held: Array = np.maximum.accumulate(times)
    if (held != times).any():
        notes.append(f"the clock runs back at {np.count_nonzero(held != times)} frames, held there")
    since_start: Array = held - held[0]
    return since_start


def camera_recording(
    path: Path,
    skeleton: Skeleton,
    camera_to_world: Array,
    *,
    times: Array,
    positions: Array,
    confidence: Array,
    performers: NDArray[np.int64] | None = None,
    rotations: Array | None = None,
    notes: list[str],
) -> Recording:
    """A recording from what a depth camera saw.

    None of the files holds a floor plane, and cameras look down: the recording is levelled by how
    the performer stands. The first performer is turned to face +Z at the start and put above the
    origin; the floor, y = 0, is where the feet stand.

    Args:
        path: the file, for messages.
        skeleton: the joints.
        camera_to_world: (3, 3) rotation from camera axes to ours, see `devices.kinect.joints`.
        times: (T,) [s] from 0, never falling.
        positions: (T, J, 3) [m] camera space; the origin itself, what is not finite and what is
            further than a Kinect can see count as unseen.
        confidence: (T, J) in [0, 1].
        performers: (T,); all 0 if None.
        rotations: (T, J, 4) joint to camera, (x, y, z, w), all zero where unknown; or None.
        notes: what the reader guessed or mended.

    Raises:
        InputError: no joint is seen in any frame.
    """
    far = ~(np.abs(positions) < _FURTHEST).all(axis=2)
    seen = ~far & (positions != 0).any(axis=2) & (confidence > 0)
    if not seen.any():
        raise InputError(f"{path}: no joint is seen in any frame")
    world = np.where(seen[..., None], positions, np.nan) @ camera_to_world.T
    performers = np.zeros(len(times), dtype=np.int64) if performers is None else performers
    turn = _to_front(skeleton, world[performers == 0], notes)
    world = world @ turn.T
    world -= floor_and_start(world, hips_joint(skeleton), stray=_STRAY)
    return Recording(
        skeleton=skeleton,
        times=times,
        positions=world,
        rotations=None if rotations is None else _turned(rotations, turn @ camera_to_world),
        confidence=np.where(seen, np.clip(confidence, 0.0, 1.0), 0.0),
        performers=performers,
        arrivals=np.full(len(times), np.nan),
        notes=tuple(notes),
    )


def _to_front(skeleton: Skeleton, world: Array, notes: list[str]) -> Array:
    """The rotation (3, 3) that levels what was seen and turns the performer to the front."""
    level = np.eye(3)
    axis = standing_axis(skeleton, label_joints(skeleton), world)
    if axis is not None and axis[1] > _STEEPEST:
        level = upright(axis)
        tilt = float(np.degrees(np.arccos(min(axis[1], 1.0))))
        notes.append(f"levelled by {tilt:.0f} degrees, as the performer stands")
    yaw = yaw_to_front(skeleton, world @ level.T)
    if yaw is None:
        return level
    degrees = float(np.degrees(np.arctan2(yaw[0, 2], yaw[0, 0])))
    notes.append(f"turned by {degrees:.0f} degrees from the camera's view to face the front")
    return yaw @ level


def _turned(rotations: Array, turn: Array) -> Array:
    """Rotations (T, J, 4) with `turn` (3, 3) applied after them; NaN where they are all zero."""
    flat = rotations.reshape(-1, 4)
    length = np.linalg.norm(np.where(np.abs(flat) < 1e6, flat, np.nan), axis=1)
    known = length > 1e-6
    out = np.full_like(flat, np.nan)
    if known.any():
        out[known] = (Rotation.from_matrix(turn) * Rotation.from_quat(flat[known])).as_quat()
    return out.reshape(rotations.shape)
