"""How a performer's pelvis, chest and head have turned from standing upright, from joints alone."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import (
    Quaternion,
    Vector,
    between,
    conjugate,
    from_axes,
    is_rotation,
    multiply,
    normalized,
    power,
    quaternion,
    rotate,
)
from solvers.kernels.vector import across, cross, dot, minus, norm, plus, point, scaled, unit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

UPRIGHT: Final = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
"""Turns (3, 4) of a trunk that stands upright and faces +Z."""


class TrunkJoints(NamedTuple):
    """The joints that show how a trunk is turned; -1 for one that is not there.

    Attributes:
        hips: (2,) beginnings of the left and the right leg.
        shoulders: (2,) beginnings of the left and the right arm.
        waist: a joint of the spine between them.
        neck: the joint from which the head rises.
        head: the joint to which it rises.
        face: (3,) the left and the right side of the head, and the nose.
    """

    hips: Ints
    shoulders: Ints
    waist: int
    neck: int
    head: int
    face: Ints


ALL: Final = np.ones(2)
"""Shares by which pelvis and chest are turned at once: wholly."""


def trunk_turns(
    joints: Array, of: TrunkJoints, upright: Array, before: Array, shares: Array = ALL
) -> Array:
    """Return the world rotations (3, 4) of pelvis, chest and head from standing upright.

    Args:
        joints: (J, 3) [m].
        of: which joints show the turns.
        upright: (3, 4) what `orientations` gives for the upright body.
        before: (3, 4) the answer for the frame before, for parts that the joints do not show.
        shares: (2,) by which pelvis and chest turn from there to where the joints show them.
    """
    out = np.empty((3, 4))
    _turns(joints, of, upright, before, shares, out)
    return out


@kernel
def _turns(
    joints: Array, of: TrunkJoints, upright: Array, before: Array, shares: Array, out: Array
) -> None:
    frames = np.zeros((3, 4))
    _orientations(joints, of, frames)
    for part in range(3):
        own = quaternion(frames, part)
        if is_rotation(own):
            turn = normalized(multiply(own, conjugate(quaternion(upright, part))))
            if part < 2 and shares[part] < 1.0:
                turn = _part_of_way(quaternion(before, part), turn, shares[part])
        elif part == 2 and of.head >= 0:
            turn = _nod(joints, of, upright, quaternion(out, 1))
        elif part > 0:
            turn = quaternion(out, part - 1)
        else:
            turn = quaternion(before, part)
        out[part, 0], out[part, 1], out[part, 2], out[part, 3] = turn


@kernel
def _part_of_way(start: Quaternion, end: Quaternion, share: float) -> Quaternion:
    """The rotation at a share of the shorter way from one to another."""
    gap = multiply(conjugate(start), end)
    if gap[3] < 0.0:
        gap = (-gap[0], -gap[1], -gap[2], -gap[3])
    return normalized(multiply(start, power(gap, share)))


def orientations(joints: Array, of: TrunkJoints) -> Array:
    """Return the orientations (3, 4) of pelvis, chest and head; x is left, z is forward.

    A part that the joints do not show is zero. The head without a face gives the direction to which
    it rises, as (x, y, z, 0).
    """
    out = np.zeros((3, 4))
    _orientations(np.ascontiguousarray(joints), of, out)
    if not out[2].any() and of.head >= 0:
        out[2, :3] = _rise(joints, of)
    return out


@kernel
def _orientations(joints: Array, of: TrunkJoints, out: Array) -> None:
    hips, waist, chest, rise = _ways(joints, of)
    if of.hips[0] >= 0:
        _put(out, 0, _frame(hips, waist))
    if of.shoulders[0] >= 0:
        _put(out, 1, _frame(chest, rise))
    if of.face[2] >= 0:
        left = _gap(joints, of.face[1], of.face[0])
        nose = point(joints, of.face[2])
        front = minus(nose, _middle(joints, of.face[0], of.face[1]))
        # y is what is perpendicular to both, so that a nose below the ears makes no nod
        _put(out, 2, _frame(left, cross(front, left)))


@kernel
def _ways(joints: Array, of: TrunkJoints) -> tuple[Vector, Vector, Vector, Vector]:
    """To the left and up [m] of pelvis and chest; what the joints do not show means nothing."""
    hips, shoulders = of.hips, of.shoulders
    low = _middle(joints, hips[0], hips[1])
    high = _middle(joints, shoulders[0], shoulders[1])
    if of.neck >= 0:
        high = point(joints, of.neck)
    below, above = high, low  # without a waist, both reach from the hips to the neck
    if of.waist >= 0:
        below = above = point(joints, of.waist)
    return (
        _gap(joints, hips[1], hips[0]),
        minus(below, low),
        _gap(joints, shoulders[1], shoulders[0]),
        minus(high, above),
    )


@kernel
def _nod(joints: Array, of: TrunkJoints, upright: Array, chest: Quaternion) -> Quaternion:
    """The turn of a head that only shows where it rises to: the smallest, on the chest's."""
    rise = _rise(joints, of)
    rest = (upright[2, 0], upright[2, 1], upright[2, 2])
    if dot(rise, rise) < 0.5:
        return chest
    swing = between(rotate(chest, rest), rise, (1.0, 0.0, 0.0))
    return normalized(multiply(swing, chest))


@kernel
def _rise(joints: Array, of: TrunkJoints) -> Vector:
    """The unit vector from the neck to the head; zero for none."""
    base = _middle(joints, of.shoulders[0], of.shoulders[1])
    if of.neck >= 0:
        base = point(joints, of.neck)
    return unit(minus(point(joints, of.head), base), (0.0, 0.0, 0.0))


@kernel
def _frame(left: Vector, up: Vector) -> Quaternion:
    """The orientation whose x is `left` and whose y is nearest to `up`; zero where they fail."""
    zero = (0.0, 0.0, 0.0)
    x = unit(left, zero)
    y = unit(across(up, x), zero)
    if dot(x, x) < 0.5 or dot(y, y) < 0.5:
        return (0.0, 0.0, 0.0, 0.0)
    return from_axes(x, cross(x, y))


def levers(joints: Array, of: TrunkJoints) -> Array:
    """Return the lengths (2, 2) [m] by which the joints show the turns of pelvis and chest.

    The one is from the right to the left of the part; the other is how far the part reaches up,
    at right angles to it. 0 for a part that the joints do not show.
    """
    out = np.zeros((2, 2))
    _levers(np.ascontiguousarray(joints), of, out)
    return out


@kernel
def _levers(joints: Array, of: TrunkJoints, out: Array) -> None:
    hips, waist, chest, rise = _ways(joints, of)
    if of.hips[0] >= 0:
        _measure(hips, waist, out, 0)
    if of.shoulders[0] >= 0:
        _measure(chest, rise, out, 1)


@kernel
def _measure(left: Vector, up: Vector, out: Array, part: int) -> None:
    x = unit(left, (0.0, 0.0, 0.0))
    out[part, 0], out[part, 1] = norm(left), norm(minus(up, scaled(x, dot(up, x))))


@kernel
def _put(out: Array, part: int, q: Quaternion) -> None:
    out[part, 0], out[part, 1], out[part, 2], out[part, 3] = q


@kernel
def _gap(joints: Array, start: int, end: int) -> Vector:
    return minus(point(joints, end), point(joints, start))


@kernel
def _middle(joints: Array, first: int, second: int) -> Vector:
    """The point between two joints; the origin where they are not there."""
    if first < 0 or second < 0:
        return (0.0, 0.0, 0.0)
    return scaled(plus(point(joints, first), point(joints, second)), 0.5)
