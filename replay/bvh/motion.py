"""Forward kinematics of BVH: where each joint is and how it is turned, frame by frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.bvh.text import BvhJoint, BvhText

Array = NDArray[np.float64]


def rest_positions(joints: list[BvhJoint]) -> Array:
    """Where the joints stand when every rotation is zero (J, 3), in the file's unit and frame."""
    rest = np.zeros((len(joints), 3))
    for index, joint in enumerate(joints):
        rest[index] = joint.offset
        if joint.parent >= 0:
            rest[index] += rest[joint.parent]
    return rest


def forward_kinematics(text: BvhText) -> tuple[Array, Array]:
    """Positions (T, J, 3) in the file's unit and frame, rotations (T, J, 4), joint to world.

    The rotation channels of a joint multiply in the order in which it declares them, the first
    outermost. NaN in a channel makes the joint and all below it NaN.
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
            local = positions[joint.parent] + _rotated(turn, local)
        positions[index] = local
        for (axis, kind), value in zip(joint.channels, values.T, strict=True):
            if kind == "rotation":
                turn[:] = _turned_about(turn, axis, np.radians(value))
    return positions.transpose(1, 0, 2).copy(), rotations.transpose(1, 0, 2).copy()


def _translation(joint: BvhJoint, values: Array) -> Array:
    """Where a joint stands in its parent's frame (T, 3).

    Files disagree on what position channels below the root mean: some replace OFFSET, some add to
    it, and many hold only zeros. Values that lie nearer to zero than to OFFSET add, others replace.
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


def _rotated(rotation: Array, vector: Array) -> Array:
    """Vectors (T, 3) turned by unit quaternions (T, 4)."""
    axis, w = rotation[:, :3], rotation[:, 3:]
    twice = 2.0 * np.cross(axis, vector)
    return vector + w * twice + np.cross(axis, twice)


def _turned_about(rotation: Array, axis: int, angle: Array) -> Array:
    """`rotation` (T, 4) followed, in its own frame, by `angle` (T,) [rad] about one of its axes."""
    sine, cosine = np.sin(angle / 2), np.cos(angle / 2)
    x, y, z, w = rotation.T
    by_axis = ((w, z, -y, -x), (-z, w, x, -y), (y, -x, w, -z))[axis]
    return np.stack([c * cosine + s * sine for c, s in zip((x, y, z, w), by_axis, strict=True)], 1)
