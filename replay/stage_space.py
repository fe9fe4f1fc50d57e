"""Bring a file's joints onto the stage: metres, +Y up, facing +Z, feet on the floor.

Where a file leaves unit or up axis open, they are guessed from the body (`replay.orientation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import hips_joint, label_joints
from devices.errors import ContentError
from devices.skeleton import Skeleton
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
from replay.stated import Stated
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
_NO_TURN = 1e-9  # length of a quaternion that says nothing
_CREATURE_SIZES = (0.3, 10.0)  # [m] plausible sizes of other bodies


@dataclass(frozen=True, slots=True, eq=False)
class JointMotion:
    """The joints of a file, in its own unit and axes.

    Attributes:
        names: J joint names; repeated ones are numbered.
        parents: J parents, -1 for each root.
        rest: (J, 3) the joints at rest.
        times: (T,) [s], rising.
        positions: (T, J, 3); not finite where not seen.
        rotations: (T, J, 4) joint to the file's world, not finite where unknown; or None.
        confidence: (T, J) in [0, 1], or None: 1 where seen.
        up: the file's up axis (3,), or None: it is guessed.
        metres: of the file's unit, or None: it is guessed.
    """

    names: Sequence[str]
    parents: Sequence[int]
    rest: Array
    times: Array
    positions: Array
    rotations: Array | None = None
    confidence: Array | None = None
    up: Array | None = None
    metres: float | None = None


def staged(motion: JointMotion, stated: Stated, notes: list[str]) -> Recording:
    """Return the recording of one performer, on the stage.

    Args:
        motion: as its file has it; several roots are joined under one.
        stated: comes before what the file says, and before guesses.
        notes: guesses are added.

    Raises:
        ContentError: no joint is seen.
        InputError: the joints are no tree.
    """
    motion = _under_one_root(motion, notes)
    skeleton = Skeleton(tuple(distinct(motion.names)), np.array(motion.parents), motion.rest)
    positions, rotations, rest = _on_stage(skeleton, motion, stated, notes)
    seen = np.isfinite(positions).all(axis=2)
    if not seen.any():
        raise ContentError("no joint has a usable position in any frame")
    positions[~seen] = np.nan
    given = np.ones(seen.shape) if motion.confidence is None else motion.confidence
    frames = len(positions)
    return Recording(
        skeleton=Skeleton(skeleton.names, skeleton.parents, rest),
        times=motion.times - motion.times[0],
        positions=positions,
        rotations=rotations,
        confidence=np.where(seen, given, 0.0),
        performers=np.zeros(frames, dtype=np.int64),
        arrivals=np.full(frames, np.nan),
        notes=tuple(notes),
    )


def distinct(names: Sequence[str]) -> list[str]:
    """Return names of which none repeats: later ones get a number, those without get "joint"."""
    taken = set(names)
    given: set[str] = set()
    out = []
    for name in names:
        new, number = name or "joint", 2
        while new in given or (new != name and new in taken):
            new, number = f"{name or 'joint'}_{number}", number + 1
        given.add(new)
        out.append(new)
    return out


def _on_stage(
    skeleton: Skeleton, motion: JointMotion, stated: Stated, notes: list[str]
) -> tuple[Array, Array | None, Array]:
    """Positions, rotations and rest positions in metres, +Y up, facing +Z, on the floor."""
    positions, rotations = motion.positions, motion.rotations
    up = motion.up if stated.up_axis is None else stated.up_axis
    if up is None:
        up = _up(skeleton, positions, notes)
    scale = stated.metres or motion.metres
    if scale is None:
        scale = guessed_unit(skeleton, positions, up, notes)
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
    turned = None
    if rotations is not None:
        length = np.linalg.norm(rotations, axis=2)
        known = (length > _NO_TURN) & np.isfinite(length)
        turned = followed_by(rotations, turn, known=known)
    return moved, turned, _rest(skeleton, scale, motion.up, moved, notes)


def guessed_unit(skeleton: Skeleton, positions: Array, up: Array, notes: list[str]) -> float:
    """Return the metres of a file's unit in which its body has the size of a person.

    Args:
        skeleton: as in `on_stage`.
        positions: as in `on_stage`.
        up: (3,) the file's up axis.
        notes: the guess is added.
    """
    parts = label_joints(skeleton)
    person = stands_upright(skeleton, parts, positions, up) or stands_upright(
        skeleton, parts, skeleton.rest_positions[None], up
    )
    posed = _measured(skeleton.rest_positions, positions)
    height = body_height(skeleton, parts, posed) if person else None
    return _metres(height, float(np.ptp(posed, axis=0).max()), notes)


def _under_one_root(motion: JointMotion, notes: list[str]) -> JointMotion:
    """The motion with a joint, first in order and without rotation, in the middle of its roots."""
    roots = np.flatnonzero(np.array(motion.parents) == -1)
    if len(roots) < 2:
        return motion
    notes.append(f"{len(roots)} roots, joined under one")
    name = "root"
    while name in motion.names:
        name = f"{name}_all"
    middle = _mean_seen(motion.positions[:, roots])
    count = len(motion.positions)
    unturned = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1, 1))
    rotations, confidence = motion.rotations, motion.confidence
    return replace(
        motion,
        names=[name, *motion.names],
        parents=[-1, *(parent + 1 for parent in motion.parents)],
        rest=np.concatenate([motion.rest[roots].mean(axis=0, keepdims=True), motion.rest]),
        positions=np.concatenate([middle[:, None], motion.positions], axis=1),
        rotations=None if rotations is None else np.concatenate([unturned, rotations], axis=1),
        confidence=None
        if confidence is None
        else np.concatenate([np.ones((count, 1)), confidence], axis=1),
    )


def _mean_seen(positions: Array) -> Array:
    """The mean (T, 3) of the points (T, N, 3) that are seen; NaN where none is."""
    seen = np.isfinite(positions).all(axis=2, keepdims=True)
    number = seen.sum(axis=1)
    total = np.where(seen, positions, 0.0).sum(axis=1)
    mean: Array = np.divide(total, number, out=np.full(total.shape, np.nan), where=number > 0)
    return mean


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


def _rest(
    skeleton: Skeleton, scale: float, known: Array | None, moved: Array, notes: list[str]
) -> Array:
    """The zero pose, levelled on its own; the first whole frame if the zero pose does not stand.

    A zero pose that stands along the up axis of its format, where that is `known`, is level.
    """
    parts = label_joints(skeleton)
    y = np.array([0.0, 1.0, 0.0])
    rest = skeleton.rest_positions * scale
    up = up_axis(skeleton, parts, rest[None], rest)
    if up is not None and known is not None and rises(skeleton, parts, rest, known):
        up = known
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
