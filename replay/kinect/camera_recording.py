"""Convert joints in a depth camera's space to a recording that is level and faces the front."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import hips_joint, label_joints
from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.orientation import floor_and_start, standing_axis, yaw_to_front
from replay.recording import Recording
from solvers.signal.floor_plane import upright
from solvers.skeleton.quaternions import followed_by

Array = NDArray[np.float64]

KINECT_RATE = 30.0  # [Hz] of every Kinect's skeleton stream
_STEEPEST = np.cos(np.radians(40))  # largest plausible tilt of a camera on a stand
_STRAY = 0.02  # share of the frames whose lowest joint may be tracked below the floor
_FURTHEST = 100.0  # [m] beyond a Kinect's range


def rising(path: Path, times: Array, notes: list[str]) -> Array:
    """Return times (T,) [s] from 0 that never fall; where the file's clock runs back, it stops.

    Raises:
        InputError: a time is not a finite number.
    """
    if not np.isfinite(times).all() or np.abs(times).max() > 1e12:
        raise InputError(
            f"{path}: frame {int(np.argmin(np.isfinite(times))) + 1} has no usable time"
        )
    forward: Array = np.maximum.accumulate(times)
    if (forward != times).any():
        back = np.count_nonzero(forward != times)
        notes.append(f"the clock runs back at {back} frames; it is stopped there")
    since_start: Array = forward - forward[0]
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
    """Return a recording from positions in a depth camera's space.

    The files hold no floor plane, and cameras look down: the recording is levelled so that the
    performer stands upright. The first performer is turned to face +Z at the start and placed above
    the origin; the floor, y = 0, is where the feet stand.

    Args:
        path: the file, for messages.
        skeleton: the joints.
        camera_to_world: (3, 3) rotation from camera axes to ours, see `devices.kinect.joints`.
        times: (T,) [s] from 0, never falling.
        positions: (T, J, 3) [m] camera space; the origin itself, values that are not finite and
            positions beyond a Kinect's range count as not seen.
        confidence: (T, J) in [0, 1].
        performers: (T,); all 0 if None.
        rotations: (T, J, 4) joint to camera, (x, y, z, w), all zero if unknown; or None.
        notes: guesses and corrections of the reader.

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
        rotations=None if rotations is None else _in_world(rotations, turn @ camera_to_world),
        confidence=np.where(seen, np.clip(confidence, 0.0, 1.0), 0.0),
        performers=performers,
        arrivals=np.full(len(times), np.nan),
        notes=tuple(notes),
    )


def _to_front(skeleton: Skeleton, world: Array, notes: list[str]) -> Array:
    """The rotation (3, 3) that levels the recording and turns the performer to the front."""
    level = np.eye(3)
    axis = standing_axis(skeleton, label_joints(skeleton), world)
    if axis is not None and axis[1] > _STEEPEST:
        level = upright(axis)
        tilt = float(np.degrees(np.arccos(min(axis[1], 1.0))))
        notes.append(f"levelled by {tilt:.0f} degrees, from the standing performer")
    yaw = yaw_to_front(skeleton, world @ level.T)
    if yaw is None:
        return level
    degrees = float(np.degrees(np.arctan2(yaw[0, 2], yaw[0, 0])))
    notes.append(f"turned by {degrees:.0f} degrees from the camera's view to face the front")
    return yaw @ level


def _in_world(rotations: Array, turn: Array) -> Array:
    """Rotations (T, J, 4) followed by `turn` (3, 3); NaN where they are all zero."""
    length = np.linalg.norm(np.where(np.abs(rotations) < 1e6, rotations, np.nan), axis=-1)
    return followed_by(rotations, turn, known=length > 1e-6)
