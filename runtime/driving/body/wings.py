"""Bends the wings of a character when the performer's arms move.

Bone for bone, a bent elbow would fold a wing in the middle like a board. A wing has no elbow to be
seen: its bend is spread over its whole length, and is limited. Neither does a wing reach as far to
the front as an arm, nor close above the head.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_names import Side
from runtime.driving.body.body_parts import Arm, TwoBodies
from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import (
    Vector,
    between,
    conjugate,
    multiply,
    normalized,
    rotate,
)
from solvers.kernels.vector import cross, dot, minus, norm, plus, point, scaled, unit

Array = NDArray[np.float64]

_FORWARD = math.radians(50.0)  # from its side: as far as a wing turns to the front or back
_LEVEL = 0.2  # of its length: an arm that leads less far from the vertical shows no such turn
_RISES, _HIGHEST = math.radians(45.0), math.radians(75.0)  # above level: as the arm, at most
_BEND = math.radians(65.0)  # at most, of its outer against its inner half
_ENDS = (0.1, 0.9)  # of its length, between which a wing bends


@dataclass(frozen=True, slots=True, eq=False)
class _Wing:
    """A wing and the arm that leads it.

    Attributes:
        joints: shoulder, elbow and wrist of the performer.
        out: (3,) unit, to the wing's own side.
        along: (2, 3) unit directions of its halves at rest.
        shares: (n,) of the bend that each of its bones takes.
        segments: (n,) their numbers.
    """

    joints: tuple[int, int, int]
    out: Array
    along: Array
    shares: Array
    segments: NDArray[np.int64]


class Wings:
    """The wings of a character; of a body that has arms there are none.

    Args:
        bodies: the performer and the character.
        arms: the character's arms that are driven.
    """

    def __init__(self, bodies: TwoBodies, arms: Sequence[Arm]) -> None:
        self._front = np.array([np.sin(bodies.facing), 0.0, np.cos(bodies.facing)])
        are_wings = bodies.plan.arm_word == "wing"
        self._wings = [_wing(bodies, arm) for arm in arms if are_wings]
        # Once for no bone, so that no frame waits for the kernel.
        ways, out = np.eye(3)[:2], np.eye(3)[0]
        still = np.array([0.0, 0.0, 0.0, 1.0])
        bend_wing(ways, still, out, self._front, ways, np.zeros(0), np.zeros((0, 4)))

    def spread(self, joints: Array, chest: Array, given: Array) -> None:
        """Put the rotations of all bones of the wings into `given` (S, 4), those of the segments.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
            chest: (4,) the turn of the character's chest from rest.
            given: is changed.
        """
        for wing in self._wings:
            a, b, c = wing.joints
            turns = np.empty((len(wing.segments), 4))
            ways = np.stack([joints[b] - joints[a], joints[c] - joints[b]])
            bend_wing(ways, chest, wing.out, self._front, wing.along, wing.shares, turns)
            given[wing.segments] = turns


def _wing(bodies: TwoBodies, arm: Arm) -> _Wing:
    """A wing at rest, led by the performer's arm of its side."""
    theirs = bodies.source.arms[arm.side]
    lower = theirs.lower or theirs.upper
    places = bodies.tree.positions[list(arm.target)]
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    middles = np.cumsum(lengths) - 0.5 * lengths
    share = np.interp(middles / max(float(lengths.sum()), 1e-12), _ENDS, (0.0, 1.0))
    half = int(np.argmin(np.abs(np.cumsum(lengths) - 0.5 * lengths.sum()))) + 1
    half = min(half, max(len(places) - 2, 1))
    ways = np.stack([places[half] - places[0], places[-1] - places[min(half, len(places) - 2)]])
    along = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    return _Wing(
        joints=(theirs.upper[0], lower[0], lower[-1]),
        out=bodies.left if arm.side is Side.LEFT else -bodies.left,
        along=along,
        shares=share * share * (3.0 - 2.0 * share),
        segments=np.array(arm.segments, dtype=np.int64),
    )


@kernel
def bend_wing(
    ways: Array, chest: Array, out: Array, front: Array, along: Array, shares: Array, turns: Array
) -> None:
    """Turn the bones of a wing.

    Args:
        ways: (2, 3) along the performer's upper arm and forearm.
        chest: (4,) the turn of the character's chest from rest.
        out, front: (3,) unit, to the wing's own side and to where the character looks at rest.
        along: (2, 3) unit directions of the wing's halves at rest.
        shares: (n,) of the bend that each bone takes.
        turns: (n, 4) world rotations from rest; overwritten.
    """
    carry = (chest[0], chest[1], chest[2], chest[3])
    side, ahead = (out[0], out[1], out[2]), (front[0], front[1], front[2])
    inner = rotate(carry, _limited(rotate(conjugate(carry), point(ways, 0)), side, ahead))
    outer = rotate(carry, _limited(rotate(conjugate(carry), point(ways, 1)), side, ahead))
    angle = math.atan2(norm(cross(inner, outer)), dot(inner, outer))
    if angle > 0.0:
        bend = _BEND * math.tanh(angle / _BEND)
        across = unit(minus(outer, scaled(inner, dot(inner, outer))), (0.0, 0.0, 0.0))
        outer = plus(scaled(inner, math.cos(bend)), scaled(across, math.sin(bend)))
        outer = unit(outer, inner)
    axis = (0.0, 1.0, 0.0)
    first = multiply(between(rotate(carry, point(along, 0)), inner, axis), carry)
    second = multiply(between(rotate(first, point(along, 1)), outer, axis), first)
    sign = 1.0
    if multiply(conjugate(first), second)[3] < 0.0:
        sign = -1.0
    for bone in range(len(shares)):
        here, there = 1.0 - shares[bone], sign * shares[bone]
        mixed = normalized(
            (
                here * first[0] + there * second[0],
                here * first[1] + there * second[1],
                here * first[2] + there * second[2],
                here * first[3] + there * second[3],
            )
        )
        turns[bone, 0], turns[bone, 1], turns[bone, 2], turns[bone, 3] = mixed


@kernel
def _limited(way: Vector, out: Vector, front: Vector) -> Vector:
    """The direction of a wing where an arm leads `way`, both seen from the chest."""
    own = unit(way, out)
    side, ahead = dot(own, out), dot(own, front)
    level = math.hypot(side, ahead)
    turn = math.atan2(ahead, side)
    fade = min(2.0 * (1.0 - abs(turn) / math.pi), 1.0)  # across the back, front is like behind
    shown = level * level / (level * level + _LEVEL * _LEVEL)
    turn = _FORWARD * math.tanh(turn / _FORWARD) * fade * shown
    rise = math.atan2(own[1], level)
    if rise > _RISES:
        room = _HIGHEST - _RISES
        rise = _RISES + room * math.tanh((rise - _RISES) / room)
    far = math.cos(rise)
    limited = plus(scaled(out, far * math.cos(turn)), scaled(front, far * math.sin(turn)))
    return plus(limited, (0.0, math.sin(rise), 0.0))
