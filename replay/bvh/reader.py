"""Read BVH files as recordings; unit, up axis and heading are guessed, and noted."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import hips_joint, label_joints
from devices.errors import InputError
from devices.skeleton import Skeleton
from replay.bvh.motion import forward_kinematics, rest_positions
from replay.bvh.text import BvhJoint, read_bvh_text
from replay.orientation import (
    body_height,
    floor_and_start,
    hips_at_leg_height,
    legs_hang,
    rises,
    stands_upright,
    up_axis,
    up_to_y,
    yaw_to_front,
)
from replay.recording import Recording
from replay.stated import UNSTATED, Stated
from solvers.skeleton.quaternions import followed_by

Array = NDArray[np.float64]

_UNITS = (  # name, metres, and the plausible heights [m] of a person in that unit
    ("metres", 1.0, (1.2, 2.5)),
    ("centimetres", 0.01, (1.2, 2.5)),
    ("millimetres", 0.001, (1.2, 2.5)),
    ("inches", 0.0254, (1.4, 2.1)),
    ("decimetres", 0.1, (1.4, 2.1)),
    ("CMU units of 1/0.45 inch", 0.0254 / 0.45, (1.3, 2.1)),
)
_USUAL_HEIGHT = 1.7  # [m] of a person if no unit gives a plausible height
_CREATURE_SIZES = (0.3, 10.0)  # [m] plausible sizes of other bodies


def recognises_bvh(path: Path, head: bytes) -> bool:
    """Whether the file begins with HIERARCHY, or its name ends with .bvh."""
    start = head.replace(b"\x00", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return start[:9].upper() == b"HIERARCHY" or path.suffix.lower() == ".bvh"


def read_bvh(path: Path, stated: Stated = UNSTATED) -> Recording:
    """Read a BVH file and convert it to metres, +Y up, facing +Z.

    Rotations are joint to world and identity in the file's zero pose, up to the rotation of the
    whole recording. End sites become joints with their parent's name and "_end". Rest positions are
    the zero pose, levelled on its own, or the first frame if the zero pose is unusable. Several
    roots are joined under one. Unit, up axis and heading are guessed from the body (see
    `replay.orientation`), and noted; `stated` decides unit and up axis instead.

    Raises:
        InputError: the file is not BVH, or is damaged; the message gives the line.
    """
    text = read_bvh_text(path)
    notes = list(text.notes)
    positions, rotations = forward_kinematics(text)
    rest = rest_positions(text.joints)
    names = _unique_names(text.joints, notes)
    parents = [joint.parent for joint in text.joints]
    if parents.count(-1) > 1:
        notes.append(f"{parents.count(-1)} roots, joined under one")
        positions, rotations, rest = _under_one_root(parents, positions, rotations, rest)
        names = [_free_name("root", names), *names]
        parents = [-1, *(parent + 1 for parent in parents)]
    skeleton = Skeleton(tuple(names), np.array(parents), rest)
    positions, rotations, rest = _canonical(skeleton, positions, rotations, stated, notes)
    seen = np.isfinite(positions).all(axis=2)
    if not seen.any():
        raise InputError(f"{path}: no joint has a usable position in any frame")
    positions[~seen] = np.nan
    frames = len(positions)
    return Recording(
        skeleton=Skeleton(skeleton.names, skeleton.parents, rest),
        times=np.arange(frames, dtype=np.float64) * text.frame_time,
        positions=positions,
        rotations=rotations,
        confidence=np.where(seen, 1.0, 0.0),
        performers=np.zeros(frames, dtype=np.int64),
        arrivals=np.full(frames, np.nan),
        notes=tuple(notes),
    )


def _unique_names(joints: list[BvhJoint], notes: list[str]) -> list[str]:
    """The names of all joints: end sites named after their parents, repeated names numbered."""
    taken = {joint.name for joint in joints if joint.name}
    given: Counter[str] = Counter()
    names: list[str] = []
    for joint in joints:
        name = joint.name or (f"{names[joint.parent]}_end" if joint.parent >= 0 else "end")
        if given[name] or (not joint.name and name in taken):
            number = given[name] + 1
            while f"{name}_{number}" in taken:
                number += 1
            given[name] = number
            name = f"{name}_{number}"
        given[name] += 1
        taken.add(name)
        names.append(name)
    repeated = len(joints) - len({joint.name for joint in joints if joint.name})
    repeated -= sum(not joint.name for joint in joints)
    if repeated:
        notes.append(f"{repeated} joint names repeat and were numbered")
    return names


def _free_name(name: str, names: list[str]) -> str:
    while name in names:
        name = f"{name}_all"
    return name


def _under_one_root(
    parents: list[int], positions: Array, rotations: Array, rest: Array
) -> tuple[Array, Array, Array]:
    """Add a joint, first in order and without rotation, in the middle of the roots."""
    roots = np.flatnonzero(np.array(parents) == -1)
    middle = positions[:, roots].mean(axis=1, keepdims=True)
    unturned = np.tile([0.0, 0.0, 0.0, 1.0], (len(positions), 1, 1))
    return (
        np.concatenate([middle, positions], axis=1),
        np.concatenate([unturned, rotations], axis=1),
        np.concatenate([rest[roots].mean(axis=0, keepdims=True), rest]),
    )


def _canonical(
    skeleton: Skeleton, positions: Array, rotations: Array, stated: Stated, notes: list[str]
) -> tuple[Array, Array, Array]:
    """Positions, rotations and rest positions in metres, +Y up, facing +Z, on the floor."""
    parts = label_joints(skeleton)
    up = stated.up_axis
    if up is None:
        up = _up(skeleton, positions, notes)
    person = stands_upright(skeleton, parts, positions, up) or stands_upright(
        skeleton, parts, skeleton.rest_positions[None], up
    )
    posed = _measured(skeleton.rest_positions, positions)
    height = body_height(skeleton, parts, posed) if person else None
    scale = stated.metres or _metres(height, float(np.ptp(posed, axis=0).max()), notes)
    turn = up_to_y(up)
    moved = positions @ (scale * turn.T)
    yaw = yaw_to_front(skeleton, moved)
    if yaw is None:
        notes.append(
            "heading unchanged: no left and right hips or shoulders are known, seen from above"
        )
    else:
        moved, turn = moved @ yaw.T, yaw @ turn
    moved -= floor_and_start(moved, hips_joint(skeleton))
    known: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(rotations), axis=2)
    turned = followed_by(rotations, turn, known=known)
    return moved, turned, _rest(skeleton, scale, moved, notes)


def _up(skeleton: Skeleton, positions: Array, notes: list[str]) -> Array:
    """The up axis of the file: of the zero pose if that stands, else of the motion.

    People who crawl, lie or stand on their hands stay so. Where somebody walks upright along
    another axis than the zero pose's, with the hips a leg's length above the origin, the file's
    root turns the body up, and the motion's axis counts.
    """
    parts = label_joints(skeleton)
    rest = skeleton.rest_positions
    moving = up_axis(skeleton, parts, positions, rest)
    if moving is None:
        notes.append("up axis taken as +Y: no legs or head are known by name (--up-input AXIS)")
        return np.array([0.0, 1.0, 0.0])
    zero = up_axis(skeleton, parts, rest[None], rest)
    up = moving
    if zero is not None and (zero != moving).any() and rises(skeleton, parts, rest, zero):
        if not hips_at_leg_height(skeleton, parts, positions, moving):
            up = zero
        notes.append(
            f"the zero pose stands along {_axis_name(zero)}, the motion along "
            f"{_axis_name(moving)}: {_axis_name(up)} is up (--up-input AXIS says otherwise)"
        )
    elif up[1] != 1.0:
        notes.append(f"up axis is {_axis_name(up)} (--up-input AXIS says otherwise)")
    return up


def _axis_name(axis: Array) -> str:
    return f"{'-+'[int(axis.sum() > 0)]}{'XYZ'[int(np.argmax(np.abs(axis)))]}"


def _measured(rest: Array, positions: Array) -> Array:
    """A pose (J, 3) with the bones' lengths: the zero pose, or one of the motion.

    The offsets of some files are zero, and all positions stand in channels.
    """
    whole = positions[np.isfinite(positions).all(axis=(1, 2))]
    if not len(whole):
        return rest
    posed: Array = whole[len(whole) // 2]
    return rest if np.ptp(rest, axis=0).max() > 0.1 * np.ptp(posed, axis=0).max() else posed


def _metres(height: float | None, size: float, notes: list[str]) -> float:
    """Metres per unit of the file, from a person's height, else from the skeleton's size."""
    if height is None or height <= 0:
        for unit, metres, _ in _UNITS[:3]:
            if _CREATURE_SIZES[0] <= size * metres <= _CREATURE_SIZES[1]:
                notes.append(
                    f"unit guessed: {unit}, {size * metres:.2f} m long (--unit-input UNIT)"
                )
                return metres
        notes.append(f"unit unknown, scaled to {_USUAL_HEIGHT} m (--unit-input UNIT)")
        return _USUAL_HEIGHT / size if size > 0 else 1.0
    for unit, metres, (least, most) in _UNITS:
        if least <= height * metres <= most:
            notes.append(f"unit guessed: {unit}, {height * metres:.2f} m tall (--unit-input UNIT)")
            return metres
    notes.append(f"unit unknown, scaled to a height of {_USUAL_HEIGHT} m (--unit-input UNIT)")
    return _USUAL_HEIGHT / height


def _rest(skeleton: Skeleton, scale: float, moved: Array, notes: list[str]) -> Array:
    """The zero pose, levelled on its own; the first whole frame if the zero pose does not stand."""
    parts = label_joints(skeleton)
    y = np.array([0.0, 1.0, 0.0])
    rest = skeleton.rest_positions * scale
    up = up_axis(skeleton, parts, rest[None], rest)
    if up is not None:
        rest = rest @ up_to_y(up).T
        stands = stands_upright(skeleton, parts, rest[None], y) and legs_hang(
            skeleton, parts, rest, y
        )
        whole = np.isfinite(moved).all(axis=(1, 2))
        if not stands and stands_upright(skeleton, parts, moved, y) and whole.any():
            notes.append("the zero pose does not stand; the first frame is the rest pose")
            rest = moved[int(np.argmax(whole))]
    yaw = yaw_to_front(skeleton, rest[None])
    rest = rest if yaw is None else rest @ yaw.T
    return rest - floor_and_start(rest[None], hips_joint(skeleton))
