"""Turn, scale and place a recording: metres, +Y up, the performer facing +Z, feet on the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import first_of, heading_joints
from devices.bodies.joint_names import BodyPart, Kind, Side
from devices.skeleton import Skeleton

Array = NDArray[np.float64]

_SIDES = (Side.LEFT, Side.RIGHT)
_MOST_SAMPLES = 200  # frames used for a statistic of the whole recording
_REST_WEIGHT = 0.2  # of the rest pose beside the motion, for a performer who lies all the time
_SPINE_WEIGHT = 0.5  # of the spine beside the legs: an elephant's spine is level
_LEAST_TURN = 0.2  # of the joints' distance that must remain, seen from above, to give a heading
_STRAIGHT = 0.96  # least ratio of the distance from ankle to head to the length of the bones
_LEAST_STANDING = 0.1  # of all frames
_LEG_AND_SPINE = 0.87  # of a body's height: hip to ankle and pelvis to head, along the bones


def up_axis(
    skeleton: Skeleton, parts: Sequence[BodyPart | None], positions: Array, rest: Array
) -> Array | None:
    """Return the axis (3,) of the recording's own frame along which the body stands, a unit vector.

    Legs, from foot to hip, have weight 1, the spine a half, the rest pose a fifth.

    Args:
        skeleton: of `positions`; only its tree is used.
        parts: its labels.
        positions: (T, J, 3), any unit and frame; NaN where not seen.
        rest: (J, 3), in the same frame.

    Returns:
        The axis, or None if the skeleton has neither legs nor a head above hips.
    """
    frames = _sampled(positions)
    rising = _rising(skeleton, parts, frames)
    if rising is None:
        return None
    length = np.linalg.norm(rising, axis=1, keepdims=True)
    seen = np.isfinite(length[:, 0]) & (length[:, 0] > 0)
    mean = (rising[seen] / length[seen]).mean(axis=0) if seen.any() else np.zeros(3)
    at_rest = _rising(skeleton, parts, rest[None])
    if at_rest is not None and np.linalg.norm(at_rest[0]) > 0:
        mean = mean + _REST_WEIGHT * at_rest[0] / np.linalg.norm(at_rest[0])
    axis = np.zeros(3)
    axis[np.argmax(np.abs(mean))] = np.sign(mean[np.argmax(np.abs(mean))]) or 1.0
    return axis


def stands_upright(
    skeleton: Skeleton, parts: Sequence[BodyPart | None], positions: Array, up: Array
) -> bool:
    """Whether the head is above the hips, within 60 degrees, in most frames, as in a biped."""
    spine = _between(
        _place(skeleton, parts, Kind.HIPS), _head(skeleton, parts), _sampled(positions)
    )
    if spine is None:
        return False
    rise = (spine @ up) / np.maximum(np.linalg.norm(spine, axis=1), 1e-12)
    rise = rise[np.isfinite(rise)]
    return bool(rise.size and np.median(rise) > 0.5)


def legs_hang(skeleton: Skeleton, parts: Sequence[BodyPart | None], pose: Array, up: Array) -> bool:
    """Whether the legs of a pose (J, 3), if it has any, hang within 60 degrees."""
    for side in _SIDES:
        hip, foot = (_place(skeleton, parts, kind, side) for kind in (Kind.UPPER_LEG, Kind.FOOT))
        leg = _between(foot, hip, pose[None])
        if leg is not None and not leg[0] @ up > 0.5 * np.linalg.norm(leg[0]):
            return False
    return True


def rises(skeleton: Skeleton, parts: Sequence[BodyPart | None], pose: Array, up: Array) -> bool:
    """Whether a pose (J, 3) stands along an axis: its legs hang, and its head is not below."""
    spine = _between(_place(skeleton, parts, Kind.HIPS), _head(skeleton, parts), pose[None])
    level = spine is None or spine[0] @ up >= -0.5 * np.linalg.norm(spine[0])
    return bool(level) and legs_hang(skeleton, parts, pose, up)


def hips_at_leg_height(
    skeleton: Skeleton, parts: Sequence[BodyPart | None], positions: Array, up: Array
) -> bool:
    """Whether the hips keep about a leg's length above the origin, as in somebody who walks.

    Args:
        skeleton: of `positions`.
        parts: its labels.
        positions: (T, J, 3) as the file has them, its floor at the origin.
        up: (3,) unit vector.
    """
    frames = _sampled(positions)
    legs = [
        _between(
            _place(skeleton, parts, Kind.FOOT, side),
            _place(skeleton, parts, Kind.UPPER_LEG, side),
            frames,
        )
        for side in _SIDES
    ]
    lengths = np.array([np.linalg.norm(leg, axis=1) for leg in legs if leg is not None])
    lengths = lengths[np.isfinite(lengths)]
    hips = _place(skeleton, parts, Kind.HIPS)
    if hips is None or not lengths.size:
        return False
    leg, height = lengths.max(), frames[:, hips] @ up
    height = height[np.isfinite(height)]
    low, high = (np.percentile(height, (10, 90)) / max(leg, 1e-12)) if height.size else (0.0, 0.0)
    return bool(low > 0.5 and high < 1.6)


def standing_axis(
    skeleton: Skeleton, parts: Sequence[BodyPart | None], positions: Array
) -> Array | None:
    """Return the direction (3,) from feet to head in frames in which the body is straight.

    A camera that looks down sees everyone lean; the median over the frames in which legs and back
    are stretched is the vertical. None if there are too few such frames.

    Args:
        skeleton: of `positions`.
        parts: its labels.
        positions: (T, J, 3); NaN where not seen.
    """
    head, hips = _head(skeleton, parts), _place(skeleton, parts, Kind.HIPS)
    knees = [_place(skeleton, parts, Kind.LOWER_LEG, side) for side in _SIDES]
    feet = [_place(skeleton, parts, Kind.FOOT, side) for side in _SIDES]
    if head is None or hips is None or None in (*knees, *feet):
        return None
    straight = np.ones(len(positions), dtype=bool)
    for leg in zip(feet, knees, strict=True):
        bones = np.diff(positions[:, np.array([*leg, hips, head])], axis=1)
        length = np.linalg.norm(bones, axis=2).sum(axis=1)
        straight &= np.linalg.norm(bones.sum(axis=1), axis=1) > _STRAIGHT * length
    if np.count_nonzero(straight) < max(1, _LEAST_STANDING * len(positions)):
        return None
    between_feet = positions[straight][:, np.array(feet)].mean(axis=1)
    axis: Array = np.median(positions[straight, head] - between_feet, axis=0)
    return axis / np.linalg.norm(axis) if axis.any() else None


def body_height(skeleton: Skeleton, parts: Sequence[BodyPart | None], rest: Array) -> float | None:
    """Return the height of a person with these bones, from leg and spine lengths, in any pose.

    Returns:
        The height in the unit of `rest`, or None if a leg, the hips or the head is missing.
    """
    head = _head(skeleton, parts)
    hips = _place(skeleton, parts, Kind.HIPS)
    legs = []
    for side in _SIDES:
        ends = [_place(skeleton, parts, kind, side) for kind in (Kind.UPPER_LEG, Kind.FOOT)]
        if ends[0] is not None and ends[1] is not None:
            legs.append(_along(skeleton, rest, ends[0], ends[1]))
    if head is None or hips is None or not legs:
        return None
    return (float(np.mean(legs)) + _along(skeleton, rest, hips, head)) / _LEG_AND_SPINE


def up_to_y(up: Array) -> Array:
    """Return the rotation (3, 3) by quarter turns that carries `up`, one of six axes, to +Y."""
    y = np.array([0.0, 1.0, 0.0])
    if up[1] != 0:
        return np.diag([1.0, up[1], up[1]])  # half a turn about X if -Y is up
    turn = np.cross(up, y)
    return np.outer(turn, turn) + np.outer(y, up) - np.outer(up, y)


def yaw_to_front(skeleton: Skeleton, positions: Array) -> Array | None:
    """Return the rotation (3, 3) about +Y after which the performer faces +Z in the first frame.

    Left hips and shoulders are turned to +X. The first frame in which they are seen and are not one
    above the other decides.

    Args:
        skeleton: of `positions`.
        positions: (T, J, 3), +Y up.
    """
    pairs = heading_joints(skeleton)
    if not pairs:
        return None
    for frame in positions:
        across = np.array([frame[left] - frame[right] for left, right in pairs])
        across = across[np.isfinite(across).all(axis=1)]
        if not len(across):
            continue
        x, _, z = across.sum(axis=0)
        flat = float(np.hypot(x, z))
        if flat > _LEAST_TURN * float(np.linalg.norm(across, axis=1).sum()):
            return np.array(
                [[x / flat, 0.0, z / flat], [0.0, 1.0, 0.0], [-z / flat, 0.0, x / flat]]
            )
    return None


def floor_and_start(positions: Array, hips: int, stray: float = 0.0) -> Array:
    """Return the offset (3,) to subtract: lowest joint to y = 0, first hips to x = z = 0.

    Args:
        positions: (T, J, 3); NaN where not seen.
        hips: the joint that starts above the origin.
        stray: share of the frames whose lowest joint may lie below the floor, by bad tracking.
    """
    seen = positions[np.isfinite(positions[:, hips]).all(axis=1), hips]
    low = np.where(np.isfinite(positions[..., 1]), positions[..., 1], np.inf).min(axis=1)
    low = low[np.isfinite(low)]
    x, z = (seen[0, 0], seen[0, 2]) if len(seen) else (0.0, 0.0)
    return np.array([x, np.quantile(low, stray) if low.size else 0.0, z])


def _sampled(positions: Array) -> Array:
    return positions[:: max(1, len(positions) // _MOST_SAMPLES)]


def _place(
    skeleton: Skeleton, parts: Sequence[BodyPart | None], kind: Kind, side: Side = Side.CENTRE
) -> int | None:
    return first_of(parts, skeleton, kind, side)


def _head(skeleton: Skeleton, parts: Sequence[BodyPart | None]) -> int | None:
    head = _place(skeleton, parts, Kind.HEAD)
    return _place(skeleton, parts, Kind.NECK) if head is None else head


def _between(start: int | None, end: int | None, frames: Array) -> Array | None:
    return None if start is None or end is None else frames[:, end] - frames[:, start]


def _rising(skeleton: Skeleton, parts: Sequence[BodyPart | None], frames: Array) -> Array | None:
    """In each frame (T, 3), the sum of the vectors that point up along a standing body."""
    vectors = []
    for side in _SIDES:
        foot = _place(skeleton, parts, Kind.FOOT, side)
        if foot is None:
            foot = _place(skeleton, parts, Kind.LOWER_LEG, side)
        leg = _between(foot, _place(skeleton, parts, Kind.UPPER_LEG, side), frames)
        if leg is not None:
            vectors.append(leg)
    spine = _between(_place(skeleton, parts, Kind.HIPS), _head(skeleton, parts), frames)
    if spine is not None:
        vectors.append(_SPINE_WEIGHT * spine)
    return None if not vectors else np.sum(vectors, axis=0)


def _along(skeleton: Skeleton, rest: Array, start: int, end: int) -> float:
    """Length of the bones from `end` up to `start`, or the straight distance if not an ancestor."""
    length, joint = 0.0, end
    while joint != start:
        parent = int(skeleton.parents[joint])
        if parent < 0:
            return float(np.linalg.norm(rest[end] - rest[start]))
        length += float(np.linalg.norm(rest[joint] - rest[parent]))
        joint = parent
    return length
