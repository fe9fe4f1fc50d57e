"""Read BVH files as recordings; unit, up axis and heading are guessed, and noted."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from devices.errors import ContentError, InputError
from replay.bvh.motion import forward_kinematics, rest_positions
from replay.bvh.text import BvhJoint, read_bvh_text
from replay.recording import Recording
from replay.stage_space import JointMotion, staged
from replay.stated import UNSTATED, Stated


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
    motion = JointMotion(
        names=names,
        parents=parents,
        rest=rest,
        times=np.arange(len(positions), dtype=np.float64) * text.frame_time,
        positions=positions,
        rotations=rotations,
    )
    try:
        return staged(motion, stated, notes)
    except ContentError as error:
        raise InputError(f"{path}: {error}") from None


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
