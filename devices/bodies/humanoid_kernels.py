"""Compiled loops for humanoid bones: decode poses, replace bad offsets, compute world poses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import exact_kernel
from solvers.kernels.short_loops import median, put

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]
Bytes = NDArray[np.uint8]

FARTHEST = 1000.0  # [m] of a plausible position
INFERRED = 0.3
"""Confidence of a joint that was not sent but is rigid with a received bone."""
UNSURE = 0.5
"""Confidence of a bone that keeps its last value, and of all bones while the sender's tracking is
bad."""
NO_LENGTH = 1e-4  # [m] below which an offset counts as missing
LONGEST_BONE = 3.0  # [m]
OUT_OF_PROPORTION = 20.0  # factor by which a bone may deviate from the scale of the whole body


class Bones(NamedTuple):
    """The received values of the bones, in our coordinates.

    Attributes:
        positions: (J, 3) [m] as sent: offset from the parent bone; of the hips, from the root.
        rotations: (J, 4) as sent: bone to parent.
        pinned_positions, pinned_rotations: (J, 3) [m] and (J, 4) in the world, of joints that a
            tracker pins.
        root: (7,) position [m] and rotation of the model's root in the world.
        sent: (J,) bool, bones that were ever received.
        pinned: (J,) bool, joints that a tracker pins.
        fresh: (J,) bool, joints in the newest frame.
    """

    positions: Array
    rotations: Array
    pinned_positions: Array
    pinned_rotations: Array
    root: Array
    sent: Mask
    pinned: Mask
    fresh: Mask


class Structure(NamedTuple):
    """The structure of a sender's set of bones.

    Attributes:
        parents: (J,) of the joints, -1 for the hips.
        order: (J,) all joints, the hips first and every parent before its children.
        absent: (J,) bool, optional bones that the model lacks.
        defaults: (J, 3) [m] offsets of the built-in body, each from the nearest ancestor that is
            not absent.
        lengths: (J,) [m] lengths of `defaults`.
        along: (K, 2) an absent bone, and the next existing bone of the trunk.
        shares: (K,) of the distance to that bone.
        seen: (J,) bool, joints with a known position.
    """

    parents: Indices
    order: Indices
    absent: Mask
    defaults: Array
    lengths: Array
    along: Indices
    shares: Array
    seen: Mask


class Axes(NamedTuple):
    """The sender's T-pose: (J, 4) rest rotations of the parents, and the inverses of the bones'."""

    upper: Array
    inverse: Array


class WorldPose(NamedTuple):
    """Positions (J, 3) [m] and world rotations (J, 4), NaN where unknown; confidence (J,)."""

    positions: Array
    rotations: Array
    confidence: Array


@exact_kernel
def read_bones(
    data: Bytes, places: Indices, joints: Indices, positions: Array, rotations: Array
) -> bool:
    """Read poses in Unity's space at offsets `places` (n,) of a packet: all of them or none.

    Each pose is seven big-endian float32: a position (3,) and a quaternion (4,).

    Returns:
        False if a pose is implausible; nothing is written then.
    """
    poses = np.empty((len(places), 7))
    for row in range(len(places)):
        for column in range(7):
            poses[row, column] = _float32(data, places[row] + 4 * column)
        px, py, pz, x, y, z, w = poses[row]
        if not abs(px) + abs(py) + abs(pz) < FARTHEST:  # NaN is not
            return False
        square = x * x + y * y + z * z + w * w
        if not 0.25 < square < 4.0:
            return False
    for row in range(len(places)):
        px, py, pz, x, y, z, w = poses[row]
        length = math.sqrt(x * x + y * y + z * z + w * w)
        _put3(positions[joints[row]], -px, py, pz)
        _put4(rotations[joints[row]], x / length, -y / length, -z / length, w / length)
    return True


@exact_kernel
def _float32(data: Bytes, place: int) -> float:
    """The big-endian float32 at an offset of a packet."""
    bits = 0
    for byte in data[place : place + 4]:
        bits = bits << 8 | int(byte)
    return float(np.uint32(bits).view(np.float32))


@exact_kernel
def pose_in_world(
    bones: Bones, structure: Structure, axes: Axes, tracking: bool, out: WorldPose
) -> None:
    """Write the pose of every joint to `out`; confidence is lower if `tracking` is False."""
    offsets = np.empty_like(bones.positions)
    turns = np.empty_like(bones.rotations)
    _normalise(bones, axes, offsets, turns)
    _complete(bones, structure, offsets)
    _place_pinned(structure.order[0], bones, offsets, turns)
    for joint in structure.order:
        above = structure.parents[joint]
        if above < 0 or bones.pinned[joint]:
            put(out.positions[joint], offsets[joint])
            put(out.rotations[joint], turns[joint])
        else:
            _rotate(out.rotations[above], offsets[joint], out.positions[joint])
            put(out.positions[joint], out.positions[joint] + out.positions[above])
            _multiply(out.rotations[above], turns[joint], out.rotations[joint])
    _judge(bones, structure.seen, tracking, out)


@exact_kernel
def _normalise(bones: Bones, axes: Axes, offsets: Array, turns: Array) -> None:
    """Convert rotations and offsets to a model whose bones have the world's axes at rest.

    With R the rest rotation of a bone in the model and P that of its parent, a local rotation q
    becomes P q R^-1 and an offset t becomes P t.
    """
    for joint in range(len(turns)):
        _multiply(bones.rotations[joint], axes.inverse[joint], turns[joint])
        _multiply(axes.upper[joint], turns[joint], turns[joint])
        _rotate(axes.upper[joint], bones.positions[joint], offsets[joint])


@exact_kernel
def _complete(bones: Bones, structure: Structure, offsets: Array) -> None:
    """Complete the offsets (J, 3) [m] from the parents: as sent if plausible, else the default."""
    hips = structure.order[0]
    usable = np.empty(len(offsets), dtype=np.bool_)
    scale = _check_offsets(offsets, structure, bones.sent, usable)
    given = usable.any() or offsets[hips].any()
    for joint in range(len(offsets)):
        if not (usable[joint] or (joint == hips and bones.sent[hips] and given)):
            put(offsets[joint], structure.defaults[joint] * scale)
    for row in range(len(structure.shares)):
        absent, following = structure.along[row]
        put(offsets[absent], structure.shares[row] * offsets[following])
    for joint in structure.order[::-1]:  # children first: a parent's offset is still its own
        above = structure.parents[joint]
        if above >= 0 and structure.absent[above]:
            put(offsets[joint], offsets[joint] - offsets[above])


@exact_kernel
def _check_offsets(given: Array, structure: Structure, sent: Mask, usable: Mask) -> float:
    """Mark the plausible bone offsets (J, 3) [m]; never the hips', which are not a bone.

    Returns:
        The sender's size as a multiple of the built-in body's; 1 if no offset is usable.
    """
    hips = structure.order[0]
    ratios = np.zeros(len(given))
    for joint in range(len(given)):
        x, y, z = given[joint]
        length = math.sqrt(x * x + y * y + z * z)
        usable[joint] = joint != hips and sent[joint] and NO_LENGTH < length < LONGEST_BONE
        if usable[joint]:
            ratios[joint] = length / structure.lengths[joint]
    if not usable.any():
        return 1.0
    scale = median(ratios[usable])
    for joint in range(len(given)):
        ratio = ratios[joint]
        usable[joint] &= scale / OUT_OF_PROPORTION < ratio < scale * OUT_OF_PROPORTION
    return scale


@exact_kernel
def _place_pinned(hips: int, bones: Bones, offsets: Array, turns: Array) -> None:
    """Place the hips on the model's root, and pinned joints at their world poses."""
    root_turn = bones.root[3:]
    _rotate(root_turn, offsets[hips], offsets[hips])
    put(offsets[hips], offsets[hips] + bones.root[:3])
    _multiply(root_turn, turns[hips], turns[hips])
    for joint in range(len(turns)):
        if bones.pinned[joint]:
            put(offsets[joint], bones.pinned_positions[joint])
            put(turns[joint], bones.pinned_rotations[joint])


@exact_kernel
def _judge(bones: Bones, seen: Mask, tracking: bool, out: WorldPose) -> None:
    """Set confidences: 1 as sent, INFERRED if rigid with a sent bone, at most UNSURE if old."""
    for joint in range(len(seen)):
        confidence = 1.0
        if not (bones.sent[joint] or bones.pinned[joint]):
            confidence = INFERRED if seen[joint] else 0.0
        if not (tracking and bones.fresh[joint]):
            confidence = min(confidence, UNSURE)
        out.confidence[joint] = confidence
        if confidence == 0.0:
            out.positions[joint] = np.nan
            out.rotations[joint] = np.nan


# Not those of solvers.kernels.quaternion, whose sums may be reordered: poses that arrive are to
# come out in the same bits on every processor, and the sums below are added in another order.
@exact_kernel
def _rotate(q: Array, v: Array, out: Array) -> None:
    """Rotate a vector (3,) by a unit quaternion; `out` may be `v`."""
    x, y, z, w = q
    a, b, c = v
    d, e, f = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    _put3(
        out,
        a + w * d + (y * f - z * e),
        b + w * e + (z * d - x * f),
        c + w * f + (x * e - y * d),
    )


@exact_kernel
def _multiply(p: Array, q: Array, out: Array) -> None:
    """Multiply quaternions: the rotation q, then p; `out` may be either."""
    px, py, pz, pw = p
    x, y, z, w = q
    _put4(
        out,
        pw * x + w * px + (py * z - pz * y),
        pw * y + w * py + (pz * x - px * z),
        pw * z + w * pz + (px * y - py * x),
        pw * w - (px * x + py * y + pz * z),
    )


@exact_kernel
def _put3(out: Array, x: float, y: float, z: float) -> None:
    out[0], out[1], out[2] = x, y, z


@exact_kernel
def _put4(out: Array, x: float, y: float, z: float, w: float) -> None:
    out[0], out[1], out[2], out[3] = x, y, z, w
