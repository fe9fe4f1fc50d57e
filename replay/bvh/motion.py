"""Forward kinematics of BVH: positions and rotations of the joints in every frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.bvh.text import BvhJoint, BvhText
from solvers.skeleton.quaternions import rotate

Array = NDArray[np.float64]


def rest_positions(joints: list[BvhJoint]) -> Array:
    """Return joint positions (J, 3) with all rotations zero, in the file's unit and frame."""
    rest = np.zeros((len(joints), 3))
    for index, joint in enumerate(joints):
        rest[index] = joint.offset
        if joint.parent >= 0:
            rest[index] += rest[joint.parent]
    return rest


def forward_kinematics(text: BvhText) -> tuple[Array, Array]:
    """Return positions (T, J, 3) in the file's unit and frame, rotations (T, J, 4) to world.

    The rotation channels of a joint multiply in the order of their declaration, the first
    outermost. NaN in a channel makes the joint and all its descendants NaN.
    """
    frames, count = len(text.motion), len(text.joints)
    positions = np.zeros((count, frames, 3))
    rotations = np.zeros((count, frames, 4))
    rotations[..., 3] = 1.0
    column = 0
    for index, joint in enumerate(text.joints):
        values = text.motion[:, column : column + len(joint.channels)]
        column += len(joint.channels)
        local = _translation(joint, values)
        turn = rotations[index]
        if joint.parent >= 0:
            turn[:] = rotations[joint.parent]
            local = positions[joint.parent] + rotate(turn, local)
        positions[index] = local
        for (axis, kind), value in zip(joint.channels, values.T, strict=True):
            if kind == "rotation":
                turn[:] = _turned_about(turn, axis, np.radians(value))
    return positions.transpose(1, 0, 2).copy(), rotations.transpose(1, 0, 2).copy()


def _translation(joint: BvhJoint, values: Array) -> Array:
    """Position of a joint in its parent's frame (T, 3).

    Files disagree on position channels below the root: in some they replace OFFSET, in some they
    add to it, and in many they are zero. Values that lie nearer to zero than to OFFSET are added,
    others replace it.
    """
    local = np.tile(np.array(joint.offset), (len(values), 1))
    channels = [place for place, (_, kind) in enumerate(joint.channels) if kind == "position"]
    if not channels:
        return local
    axes = [joint.channels[place][0] for place in channels]
    given = values[:, channels]
    from_zero = np.nansum(np.square(given))
    from_offset = np.nansum(np.square(given - local[:, axes]))
    local[:, axes] = given if from_offset <= from_zero else given + local[:, axes]
    return local


def _turned_about(rotation: Array, axis: int, angle: Array) -> Array:
    """`rotation` (T, 4) followed, in its own frame, by `angle` (T,) [rad] about one axis."""
    sine, cosine = np.sin(angle / 2), np.cos(angle / 2)
    x, y, z, w = rotation.T
    by_axis = ((w, z, -y, -x), (-z, w, x, -y), (y, -x, w, -z))[axis]
    return np.stack([c * cosine + s * sine for c, s in zip((x, y, z, w), by_axis, strict=True)], 1)
