"""Write BVH text: the hierarchy at rest, and one line of channels per frame.

+Y up. The root has six channels, position and then rotation in the order Z, X, Y. All other joints
have the three rotations, which every program reads; sliding joints have all six channels. The
format does not state a unit.
Source: Meredith and Maddock 2001, "Motion Capture File Formats Explained", section 2.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton

Array = NDArray[np.float64]

UNITS = {"cm": 100.0, "m": 1.0, "mm": 1000.0, "in": 1 / 0.0254}
"""Units of length in the file, and the number of them in a metre."""

LONE_STEP = 1 / 30  # [s] of a motion of one frame
_TIP = 0.25  # length of an added end site, relative to the bone before it
_PLACES = "Xposition Yposition Zposition"
_TURNS = "Zrotation Xrotation Yrotation"


def write_bvh(
    file: TextIO,
    skeleton: Skeleton,
    root: Array,
    rotations: Array,
    *,
    slides: Mapping[int, Array] | None = None,
    step: float = LONE_STEP,
    per_metre: float = UNITS["cm"],
) -> None:
    """Write one performer's motion.

    A leaf joint with its parent's name and "_end", the name that `replay.bvh.reader` gives to end
    sites, is written as an end site. Every other leaf gets one, a quarter of its bone further on.

    Args:
        file: open for writing.
        skeleton: its rest pose has zero rotations.
        root: (T, 3) [m] positions of the root.
        rotations: (T, J, 3, 3) world, since the rest pose.
        slides: positions (T, 3) [m] in the parent's frame of joints without a rigid bone.
        step: between two frames [s].
        per_metre: factor from metres to the file's unit.
    """
    places = {joint: per_metre * way for joint, way in (slides or {}).items()}
    places[skeleton.root] = per_metre * root
    channels = _channels(skeleton, places, rotations)
    file.write(f"{_hierarchy(skeleton, set(places), per_metre)}\n")
    file.write(f"MOTION\nFrames: {len(channels)}\nFrame Time: {step:.9f}\n")
    np.savetxt(file, channels, fmt="%.6f")


def _channels(skeleton: Skeleton, places: Mapping[int, Array], rotations: Array) -> Array:
    """All channels (T, C) in hierarchy order: the file's unit, degrees."""
    ends = _end_sites(skeleton) - set(places)
    columns = []
    for joint in _depth_first(skeleton):
        if joint in ends:
            continue
        if joint in places:
            columns.append(places[joint])
        parent, turned = int(skeleton.parents[joint]), rotations[:, joint]
        local = turned if parent < 0 else np.swapaxes(rotations[:, parent], 1, 2) @ turned
        columns.append(_euler_zxy(local))
    return np.concatenate(columns, axis=1)


def _euler_zxy(matrices: Array) -> Array:
    """Angles (T, 3) [degrees] z, x, y with R = Rz Rx Ry, continuous from frame to frame."""
    sine = np.clip(matrices[:, 2, 1], -1, 1)
    locked = np.abs(sine) > 1 - 1e-12  # z and y rotate about one axis: z takes the whole angle
    z = np.where(
        locked,
        np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0]),
        np.arctan2(-matrices[:, 0, 1], matrices[:, 1, 1]),
    )
    y = np.where(locked, 0.0, np.arctan2(-matrices[:, 2, 0], matrices[:, 2, 2]))
    angles = np.stack([z, np.arcsin(sine), y], axis=1)
    unwrapped: Array = np.degrees(np.unwrap(angles, axis=0))
    return unwrapped


def _depth_first(skeleton: Skeleton) -> list[int]:
    """The joints in hierarchy order."""
    order, waiting = [], [skeleton.root]
    while waiting:
        order.append(joint := waiting.pop())
        waiting.extend(np.flatnonzero(skeleton.parents == joint)[::-1].tolist())
    return order


def _end_sites(skeleton: Skeleton) -> set[int]:
    """Joints that only mark the end of their parent's bone."""
    children = np.bincount(skeleton.parents[skeleton.parents >= 0], minlength=len(skeleton.names))
    return {
        joint
        for joint, parent in enumerate(skeleton.parents)
        if parent >= 0
        and (children[joint], children[parent]) == (0, 1)
        and skeleton.names[joint] == f"{skeleton.names[parent]}_end"
    }


def _plain_names(skeleton: Skeleton) -> list[str]:
    """Unique names without blanks or braces, which would end a name in BVH."""
    names: list[str] = []
    for joint, name in enumerate(skeleton.names):
        plain = re.sub(r"[\s{}]+", "_", name.strip()) or "joint"
        while plain in names:
            plain += f"_{joint}"
        names.append(plain)
    return names


def _hierarchy(skeleton: Skeleton, placed: set[int], per_metre: float) -> str:
    """The text of all joints; those in `placed` have position channels.

    The root's offset is 0, since its position channels are absolute.
    """
    names, rest = _plain_names(skeleton), skeleton.rest_positions
    ends = _end_sites(skeleton) - placed
    lines = ["HIERARCHY"]
    waiting: list[tuple[int, int]] = [(skeleton.root, 0)]  # joints, or -1 for a closing brace
    while waiting:
        joint, depth = waiting.pop()
        tab = "\t" * depth
        if joint < 0:
            lines.append(f"{tab}}}")
            continue
        parent = int(skeleton.parents[joint])
        offset = per_metre * (rest[joint] - rest[parent]) if parent >= 0 else np.zeros(3)
        if joint in ends:
            lines += _end_site(tab, offset)
            continue
        lines += [
            f"{tab}{'ROOT' if parent < 0 else 'JOINT'} {names[joint]}",
            f"{tab}{{",
            f"{tab}\tOFFSET {_written(offset)}",
            f"{tab}\tCHANNELS " + (f"6 {_PLACES} {_TURNS}" if joint in placed else f"3 {_TURNS}"),
        ]
        children = np.flatnonzero(skeleton.parents == joint).tolist()
        if not children:
            lines += _end_site(f"{tab}\t", _TIP * offset)
        waiting.append((-1, depth))
        waiting.extend((child, depth + 1) for child in reversed(children))
    return "\n".join(lines)


def _end_site(tab: str, offset: Array) -> list[str]:
    return [f"{tab}End Site", f"{tab}{{", f"{tab}\tOFFSET {_written(offset)}", f"{tab}}}"]


def _written(values: Array) -> str:
    return " ".join(f"{value:.6f}" for value in values)
