"""Make a recording of joints from the markers of a file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import label_joints
from devices.bodies.skeleton_on_humanoid import at
from devices.bodies.t_pose import t_pose_of
from devices.errors import ContentError
from devices.printable import printable
from devices.skeleton import Skeleton
from replay.bounds import check_poses
from replay.markers.joint_centres import has_limbs, joint_centres, missing_parts
from replay.markers.marker_names import Subject, subjects
from replay.orientation import hips_at_leg_height, up_axis
from replay.recording import Recording
from replay.stage_space import JointMotion, staged
from replay.stated import Stated

Array = NDArray[np.float64]

_MOST_NAMED = 8  # markers and subjects in a message
_MOST_LETTERS = 24
_AXES = "XYZ"
_LIMBS = (
    ("legs", ("LowerLeg", "Foot"), "LKNE RKNE LANK RANK"),
    ("arms", ("LowerArm", "Hand"), "LSHO RSHO LELB RELB LWRA RWRA"),
)


@dataclass(frozen=True, slots=True, eq=False)
class MarkerMotion:
    """The markers of a file, in its own unit and axes.

    Attributes:
        names: M names, with the subjects' prefixes.
        times: (T,) [s], never falling.
        columns: (T, M, 3) of any numbers, perhaps a view of the file; not finite, or the very
            origin, where not seen.
        seen: (T, M), or None: wherever the numbers are finite.
        metres: of the file's unit, or None if it says none.
        up: the axis (3,) that the file says is up, or None.
    """

    names: list[str]
    times: Array
    columns: NDArray[np.generic]
    seen: NDArray[np.bool_] | None = None
    metres: float | None = None
    up: Array | None = None


def body_of_markers(motion: MarkerMotion, stated: Stated, notes: list[str]) -> Recording:
    """Return the joints of the subject of whom most markers are known.

    Raises:
        ContentError: the markers are of no set that is known, or none is seen.
    """
    found = subjects(motion.names)
    if not found:
        raise ContentError(_unknown(motion.names, "a pelvis, legs or arms"))
    subject = found[0]
    if len(found) > 1:
        others = ", ".join(repr(one.name[:_MOST_LETTERS]) for one in found[1 : _MOST_NAMED + 1])
        notes.append(f"subject {subject.name[:_MOST_LETTERS]!r}; others are left out: {others}")
    check_poses(len(motion.times), len(subject.markers))
    joints = joint_centres(_tracks(motion, subject))
    if lacking := missing_parts(list(joints)):
        raise ContentError(_unknown(motion.names, lacking))
    notes.append(f"{len(joints)} joints from {len(subject.markers)} of {len(motion.names)} markers")
    for limbs, bones, lacking in _LIMBS:
        if not has_limbs(list(joints), *bones):
            notes.append(f"{limbs} that lack markers are left out; {lacking} are needed")
    positions = np.stack(list(joints.values()), axis=1)
    skeleton = _rest(list(joints), positions)
    positions = np.stack([joints[name] for name in skeleton.names], axis=1)
    up = motion.up if stated.up_axis is None else stated.up_axis
    return staged(
        JointMotion(
            names=skeleton.names,
            parents=skeleton.parents.tolist(),
            rest=skeleton.rest_positions,
            times=motion.times,
            positions=positions,
            up=_standing(skeleton, positions, up, notes) if stated.up_axis is None else up,
            metres=motion.metres,
        ),
        stated,
        notes,
    )


def _tracks(motion: MarkerMotion, subject: Subject) -> dict[str, Array]:
    """The known markers (T, 3) of a subject; NaN where not seen."""
    tracks = {}
    for place, column in subject.markers.items():
        track = np.array(motion.columns[:, column], dtype=np.float64)
        lost = ~np.isfinite(track).all(axis=1) | ~track.any(axis=1)
        if motion.seen is not None:
            lost |= ~motion.seen[:, column]
        track[lost] = np.nan
        tracks[place] = track
    return tracks


def _rest(names: list[str], positions: Array) -> Skeleton:
    """A T-pose facing +Z, +Y up, with the median length of each bone."""
    points = {"Hips": at("", "Hips")}
    for name in ("Chest", "UpperChest", "Neck", "Head"):
        if name in names:
            points[name] = at(list(points)[-1], name)
    base = next(name for name in ("UpperChest", "Neck", "Chest", "Hips") if name in points)
    for side in ("Left", "Right"):
        for limb, root in (
            (("UpperLeg", "LowerLeg", "Foot", "Toes"), "Hips"),
            (("UpperArm", "LowerArm", "Hand", "MiddleProximal"), base),
        ):
            above = root
            for bone in limb:
                if side + bone in names:
                    points[side + bone] = at(above, side + bone)
                    above = side + bone
    return t_pose_of(points, {name: positions[:, names.index(name)] for name in points})


def _standing(skeleton: Skeleton, positions: Array, up: Array | None, notes: list[str]) -> Array:
    """The up axis: the file's, if the body goes about it, else that along which the body stands."""
    parts = label_joints(skeleton)
    standing = up_axis(skeleton, parts, positions, np.zeros_like(positions[0]))
    if standing is None:
        return np.array([0.0, 1.0, 0.0]) if up is None else up
    if up is not None and not (up != standing).any():
        return up
    if up is not None and not hips_at_leg_height(skeleton, parts, positions, standing):
        return up
    said = "" if up is None else f", where its file says {_name(up)}"
    notes.append(f"up axis {_name(standing)}, as the body stands{said} (--up-input AXIS)")
    return standing


def _name(axis: Array) -> str:
    return f"{'-+'[int(axis.sum() > 0)]}{_AXES[int(np.argmax(np.abs(axis)))]}"


def _unknown(names: list[str], lacking: str) -> str:
    """What a file's markers are, and what they would have to be."""
    some = ", ".join(printable(name, _MOST_LETTERS) for name in names[:_MOST_NAMED])
    more = ", ..." if len(names) > _MOST_NAMED else ""
    return (
        f"its {len(names)} markers ({some}{more}) are no set that is known: it lacks {lacking}; "
        "label them as Plug-in Gait does, or export the joints as BVH where they were captured"
    )
