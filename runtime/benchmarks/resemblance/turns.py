"""Turns that the directions of limbs do not show: head yaw, hand roll, finger curl."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.bodies.body_plan import SIDES, Chain
from devices.bodies.joint_names import Kind, Side
from runtime.benchmarks.resemblance.body_track import BodyTrack, angle, common_axes, unit

Array = NDArray[np.float64]

LEVEL = 0.5  # of its length along the floor; a head that looks up or down more steeply has no yaw
LEAST_TURN = 3.0  # [degrees], standard deviation; what turns less shows nothing to keep


def head_yaw_kept(
    performer: BodyTrack, character: BodyTrack, face: tuple[int, int] | None = None
) -> float:
    """The share of the performer's head turns, relative to the hips, that the character makes.

    Args:
        performer, character: the same frames of both.
        face: the performer's left and right ear or eye; without them its rotations tell.

    Returns:
        1 if it turns as much, the same way; NaN where the performer's head does not turn, or
        nothing tells.
    """
    found = common_axes(performer, character)
    theirs, ours = performer.plan.skull, character.plan.skull
    if found is None or ours is None:
        return np.nan
    if face is not None:
        left = unit(performer.positions[:, face[0]] - performer.positions[:, face[1]])
        source = _yaw(np.einsum("tij,tj->ti", found[0], left), quarter=True)
    elif theirs is not None and performer.rotations is not None:
        source = _yaw(_front(found[0], performer.rotations[:, theirs]))
    else:
        return np.nan
    if character.rotations is None:
        return np.nan
    return kept([source], [_yaw(_front(found[1], character.rotations[:, ours]))])


def hand_roll_kept(performer: BodyTrack, character: BodyTrack) -> float:
    """The share of the roll of the performer's hands about the forearms that the character makes.

    The knuckles tell where the body has them, else rotations. NaN where nothing tells.
    """
    found = common_axes(performer, character)
    if found is None:
        return np.nan
    source, target = [], []
    for side in SIDES:
        both = [_hand(body, side) for body in (performer, character)]
        if both[0] is None or both[1] is None:
            continue
        (theirs, their_width), (ours, our_width) = both[0], both[1]
        theirs, their_width = (
            np.einsum("tij,tj->ti", found[0], each) for each in (theirs, their_width)
        )
        ours, our_width = (np.einsum("tij,tj->ti", found[1], each) for each in (ours, our_width))
        mean = unit(np.nanmean(theirs, axis=0)) if np.isfinite(theirs).any() else np.zeros(3)
        source.append(roll(theirs, their_width, mean))
        target.append(beside(roll(ours, our_width, mean), source[-1]))
    return kept(source, target)


def finger_curl_kept(performer: BodyTrack, character: BodyTrack) -> float:
    """The share of the performer's finger bending that the character makes; NaN for none."""
    source, target = [], []
    for key, theirs in performer.plan.fingers.items():
        ours = character.plan.fingers.get(key)
        if ours is not None and min(len(theirs), len(ours)) > 2:
            source.append(_curl(performer, theirs))
            target.append(_curl(character, ours))
    return kept(source, target)


def kept(source: list[Array], target: list[Array]) -> float:
    """By how much targets turn for each degree that their sources turn, over all of them.

    Args:
        source, target: angles (T,) [degrees], each about any mean; NaN where not known.

    Returns:
        1 if they turn as much; NaN where no source turns by `LEAST_TURN`.
    """
    both = shared = 0.0
    for theirs, ours in zip(source, target, strict=True):
        is_known = np.isfinite(theirs) & np.isfinite(ours)
        if np.count_nonzero(is_known) < 2:
            continue
        turned, followed = (each[is_known] - each[is_known].mean() for each in (theirs, ours))
        if turned.std() >= LEAST_TURN:
            both += float((turned * followed).sum())
            shared += float(np.square(turned).sum())
    return both / shared if shared > 0.0 else np.nan


def roll(along: Array, width: Array, about: Array) -> Array:
    """The turn (T,) [degrees] of a hand about its own direction.

    Each hand is first swung, by the smallest turn, to one direction for all frames.

    Args:
        along: (T, 3) unit directions.
        width: (T, 3) unit vectors across the hand.
        about: (3,) unit; the direction that all are swung to.
    """
    out = np.full(len(along), np.nan)
    is_known = np.isfinite(along).all(axis=1) & np.isfinite(width).all(axis=1)
    a, w = along[is_known], width[is_known]
    axis, cosine = np.cross(a, about), a @ about
    around = np.maximum(1.0 + cosine, 1e-9)[:, None]  # a hand that points back has no one roll
    swung = (
        w * cosine[:, None] + np.cross(axis, w) + axis * (axis * w).sum(axis=1)[:, None] / around
    )
    first = unit(np.cross(about, np.eye(3)[np.argmin(np.abs(about))]))
    second = np.cross(about, first)
    out[is_known] = np.degrees(np.unwrap(np.arctan2(swung @ second, swung @ first)))
    return out


def beside(angles: Array, others: Array) -> Array:
    """Return the same angles (T,) [degrees], each by whole turns so near to another as it can be.

    Two hands that roll alike are a constant apart. Unwrapped alone, one of them may go round once
    more where it swings past the opposite of the direction that all are swung to.

    Args:
        angles, others: (T,) [degrees]; NaN where not known.
    """
    apart = np.radians(angles - others)
    is_known = np.isfinite(apart)
    if not is_known.any():
        return angles
    usual = np.degrees(np.angle(np.exp(1j * apart[is_known]).mean()))
    near = others + usual
    out: Array = near + (angles - near + 180.0) % 360.0 - 180.0
    return out


def _front(axes: Array, rotations: Array) -> Array:
    """The front of a joint (T, 3) in the body's axes: what points to the body's front in the mean.

    Args:
        axes: (T, 3, 3) of the body.
        rotations: (T, 4) of the joint.
    """
    out = np.full((len(axes), 3), np.nan)
    is_known = np.isfinite(rotations).all(axis=1) & np.isfinite(axes).all(axis=(1, 2))
    if is_known.any():
        turned = Rotation.from_quat(rotations[is_known])
        local = unit(turned.inv().apply(axes[is_known, 2]).mean(axis=0))
        out[is_known] = np.einsum("tij,tj->ti", axes[is_known], turned.apply(local))
    return out


def _yaw(vectors: Array, *, quarter: bool = False) -> Array:
    """The turn (T,) [degrees] about the vertical of vectors (T, 3) that point to the front.

    Args:
        vectors: in the body's axes.
        quarter: they point to the left instead.
    """
    x, z = (vectors[:, 0], vectors[:, 2]) if not quarter else (-vectors[:, 2], vectors[:, 0])
    out = np.full(len(vectors), np.nan)
    is_known = np.hypot(x, z) > LEVEL
    out[is_known] = np.degrees(np.unwrap(np.arctan2(x[is_known], z[is_known])))
    return out


def _hand(body: BodyTrack, side: Side) -> tuple[Array, Array] | None:
    """The direction (T, 3) of a hand and the vector (T, 3) across it; None where nothing tells."""
    limb = body.plan.arms.get(side)
    if limb is None or not limb.end:
        return None
    along = body.span(limb.end)
    knuckles = _knuckles(body, side)
    if knuckles is not None:
        return along, body.span(knuckles)
    if body.rotations is None:
        return None
    wrist = body.rotations[:, limb.end[0]]
    is_known = np.isfinite(wrist).all(axis=1) & np.isfinite(along).all(axis=1)
    if not is_known.any():
        return None
    turned = Rotation.from_quat(wrist[is_known])
    local = unit(turned.inv().apply(along[is_known]).mean(axis=0))
    width = np.full(along.shape, np.nan)
    width[is_known] = turned.apply(unit(np.cross(local, np.eye(3)[np.argmin(np.abs(local))])))
    return along, width


def _knuckles(body: BodyTrack, side: Side) -> Chain | None:
    first = body.plan.fingers.get((side, Kind.INDEX))
    for kind in (Kind.LITTLE, Kind.RING, Kind.MIDDLE):
        last = body.plan.fingers.get((side, kind))
        if first and last:
            return first[0], last[0]
    return None


def _curl(body: BodyTrack, chain: Chain) -> Array:
    """How much a finger bends (T,) [degrees]: the sum of the angles at its joints."""
    bones = [body.span(bone) for bone in pairwise(chain)]
    total: Array = np.sum([angle(near, far) for near, far in pairwise(bones)], axis=0)
    return total
