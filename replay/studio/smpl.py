"""Read motion of SMPL bodies (AMASS .npz) as joints, on a neutral skeleton of our own.

AMASS stores rotations of joints and no joints: those need a body, whose model has a licence of its
own. `NEUTRAL` stands in its T-pose with the proportions of an average adult (Winter 2009,
"Biomechanics and Motor Control of Human Movement", segment lengths) 1.70 m tall; shape parameters
are left out.
Source: Mahmood et al. 2019, "AMASS"; Loper et al. 2015, "SMPL", for the order of the joints.
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.bodies.joint_labels import label_joints
from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.orientation import floor_and_start, up_axis, up_to_y, yaw_to_front
from replay.recording import Recording
from replay.stated import UNSTATED, Stated
from solvers.skeleton.quaternions import followed_by, rotate

Array = NDArray[np.float64]

MOST_BYTES = 512 << 20  # of all arrays, unpacked
_DAMAGED = (
    OSError,
    ValueError,
    TypeError,
    KeyError,
    EOFError,
    RuntimeError,  # encrypted, or compressed in a way that is not known
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
)
_USUAL_RATE = 30.0
_RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate")
_CENTRE = (
    ("Pelvis", "", 0.0, 0.93, 0.0),
    ("Spine1", "Pelvis", 0.0, 1.04, -0.02),
    ("Spine2", "Spine1", 0.0, 1.16, -0.02),
    ("Spine3", "Spine2", 0.0, 1.22, -0.01),
    ("Neck", "Spine3", 0.0, 1.42, -0.03),
    ("Head", "Neck", 0.0, 1.52, 0.0),
)
_SIDE = (  # the left one; the right is its mirror image
    ("Hip", "Pelvis", 0.09, 0.90, 0.0),
    ("Knee", "Hip", 0.10, 0.49, 0.0),
    ("Ankle", "Knee", 0.10, 0.08, -0.02),
    ("Foot", "Ankle", 0.11, 0.02, 0.10),
    ("Collar", "Spine3", 0.07, 1.36, -0.02),
    ("Shoulder", "Collar", 0.18, 1.38, -0.02),
    ("Elbow", "Shoulder", 0.45, 1.38, -0.03),
    ("Wrist", "Elbow", 0.70, 1.38, -0.03),
)
ORDER = (
    "Pelvis L_Hip R_Hip Spine1 L_Knee R_Knee Spine2 L_Ankle R_Ankle Spine3 L_Foot R_Foot Neck "
    "L_Collar R_Collar Head L_Shoulder R_Shoulder L_Elbow R_Elbow L_Wrist R_Wrist"
).split()
"""The body joints in the order of their parameters."""


def _neutral() -> Skeleton:
    rows = {name: (parent, place) for name, parent, *place in _CENTRE}
    for side, across in (("L_", 1.0), ("R_", -1.0)):
        for name, parent, x, y, z in _SIDE:
            above = parent if parent in rows else side + parent
            rows[side + name] = above, [across * x, y, z]
    parents = [ORDER.index(rows[name][0]) if rows[name][0] else -1 for name in ORDER]
    places = np.array([rows[name][1] for name in ORDER], dtype=np.float64)
    return Skeleton(tuple(ORDER), np.array(parents), places)


NEUTRAL = _neutral()


def recognises_smpl(path: Path, head: bytes) -> bool:
    """Whether a file is a NumPy archive with the poses of an SMPL body."""
    if head[:2] != b"PK":
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            names = set(archive.namelist())
    except _DAMAGED:
        return False
    return "poses.npy" in names or {"root_orient.npy", "pose_body.npy"} <= names


def read_smpl(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read the motion in an AMASS file, of any SMPL body: the 22 joints of the body.

    Rotations are joint to world. The up axis is that along which the body stands, +Z in AMASS.

    Raises:
        InputError: it is damaged, too large, or has other arrays.
    """
    if stated.unit is not None:
        raise InputError(f"{path}: --unit-input says what its format says already; leave it out")
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > MOST_BYTES:
                raise InputError(f"{path}: its arrays are larger than {MOST_BYTES >> 20} MiB")
        with np.load(path, allow_pickle=False) as arrays:
            vectors, way = _parameters({name: arrays[name] for name in _wanted(arrays.files)})
            rate = next((float(arrays[name]) for name in _RATES if name in arrays.files), 0.0)
    except _DAMAGED as error:
        raise InputError(
            f"{path}: its arrays are not those of an SMPL body ({type(error).__name__})"
        ) from error
    notes = ["joints of a neutral body 1.70 m tall: the file's body shape is left out"]
    if not 0.1 < rate < 1e5:
        notes.append(f"no rate in the file: {_USUAL_RATE:.0f} frames a second (--fps-input N)")
        rate = _USUAL_RATE
    positions, rotations = _posed(vectors, way)
    up = stated.up_axis
    if up is None:
        up = up_axis(NEUTRAL, label_joints(NEUTRAL), positions, positions[0])
    turn = np.eye(3) if up is None else up_to_y(up)
    positions = positions @ turn.T
    yaw = yaw_to_front(NEUTRAL, positions)
    if yaw is not None:
        positions, turn = positions @ yaw.T, yaw @ turn
    positions -= floor_and_start(positions, 0)
    known = np.ones(rotations.shape[:2], dtype=bool)
    frames = len(positions)
    return Recording(
        skeleton=NEUTRAL,
        times=np.arange(frames, dtype=np.float64) / rate,
        positions=positions,
        rotations=followed_by(rotations, turn, known=known),
        confidence=np.ones((frames, len(ORDER))),
        performers=np.zeros(frames, dtype=np.int64),
        arrivals=np.full(frames, np.nan),
        notes=tuple(notes),
    )


def _wanted(names: list[str]) -> list[str]:
    return [name for name in ("poses", "root_orient", "pose_body", "trans") if name in names]


def _parameters(arrays: dict[str, NDArray[np.generic]]) -> tuple[Array, Array]:
    """Rotation vectors (T, 22, 3) and translations (T, 3) [m].

    Raises:
        ValueError: shapes or numbers are impossible.
    """
    parts = [arrays[name] for name in ("root_orient", "pose_body") if name in arrays]
    given = arrays["poses"] if "poses" in arrays else np.concatenate(parts, axis=1)
    poses: Array = np.asarray(given, dtype=np.float64)
    width = 3 * len(ORDER)
    if poses.ndim != 2 or poses.shape[1] < width or not len(poses):
        raise ValueError(f"Expected poses of shape (T, {width} or more), got {poses.shape}")
    way = np.asarray(arrays.get("trans", np.zeros((len(poses), 3))), dtype=np.float64)
    if way.shape != (len(poses), 3):
        raise ValueError(f"Expected translations of shape {(len(poses), 3)}, got {way.shape}")
    if not (np.abs(poses[:, :width]) < 1e4).all() or not (np.abs(way) < 1e4).all():
        raise ValueError("Expected finite, plausible numbers")
    return poses[:, :width].reshape(len(poses), len(ORDER), 3), way


def _posed(vectors: Array, way: Array) -> tuple[Array, Array]:
    """Positions (T, 22, 3) and rotations (T, 22, 4), in the file's axes."""
    count = len(vectors)
    local = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat().reshape(count, -1, 4)
    positions, rotations = np.zeros_like(vectors), np.zeros((count, len(ORDER), 4))
    rest = NEUTRAL.rest_positions
    for joint in NEUTRAL.order:
        parent = int(NEUTRAL.parents[joint])
        if parent < 0:
            positions[:, joint], rotations[:, joint] = way, local[:, joint]
            continue
        above = rotations[:, parent]
        bone = np.tile(rest[joint] - rest[parent], (count, 1))
        positions[:, joint] = positions[:, parent] + rotate(above, bone)
        turned = Rotation.from_quat(above) * Rotation.from_quat(local[:, joint])
        rotations[:, joint] = turned.as_quat()
    return positions, rotations
