"""Holds a foreleg that points as an arm does to where a foreleg can point.

An arm that points up would send a foreleg through the chest, and out at the back. A foreleg reaches
ahead instead, a little above level: the higher the arm, the more to the front. It reaches less to
the other side of the body than an arm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

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
    quaternion,
    rotate,
)
from solvers.kernels.vector import dot, minus, norm, plus, point, scaled, unit

Array = NDArray[np.float64]

_HIGHEST = math.radians(25.0)  # above level, seen from the chest: no foreleg points higher
_INWARD = 0.2  # of how far an arm reaches to the other side


class ForelegLimits:
    """Where the segments of forelegs can point, seen from the chest.

    Args:
        bodies: the performer and the character.
        arms: the forelegs.
    """

    def __init__(self, bodies: TwoBodies, arms: Sequence[Arm]) -> None:
        left, self._front, rest = bodies.left, bodies.front, bodies.tree.positions
        self._out = [left if arm.side is Side.LEFT else -left for arm in arms]
        ends = [(*arm.starts[1:], arm.target[-1]) for arm in arms]
        self._along = [
            rest[list(end)] - rest[list(arm.starts)] for arm, end in zip(arms, ends, strict=True)
        ]
        _hold(np.zeros((0, 3)), np.zeros(4), left, self._front, np.zeros((0, 4)))

    def held(self, leg: int, chest: Array, turns: Array) -> Array:
        """Return the rotations (n, 4) of a foreleg's segments, held to where it can point.

        Args:
            leg: its number.
            chest: (4,) the turn from rest of what carries it.
            turns: (n, 4) world rotations from rest.
        """
        held = turns.copy()
        _hold(self._along[leg], chest, self._out[leg], self._front, held)
        return held


@kernel
def _hold(along: Array, chest: Array, out: Array, front: Array, turns: Array) -> None:
    """Turn segments with the rest directions (n, 3) back by as much as they point too far."""
    carry = (chest[0], chest[1], chest[2], chest[3])
    side, ahead = (out[0], out[1], out[2]), (front[0], front[1], front[2])
    for segment in range(len(turns)):
        own = quaternion(turns, segment)
        rest = point(along, segment)
        if norm(rest) == 0.0:
            continue
        way = rotate(own, unit(rest, ahead))
        wish = rotate(carry, _can(rotate(conjugate(carry), way), side, ahead))
        turned = multiply(between(way, wish, ahead), own)
        turns[segment, 0], turns[segment, 1], turns[segment, 2], turns[segment, 3] = turned


@kernel
def _can(way: Vector, out: Vector, front: Vector) -> Vector:
    """The direction in which a foreleg points where an arm points `way`, seen from the chest."""
    height = way[1]
    level = minus(way, (0.0, height, 0.0))
    aside = dot(level, out)
    if aside < 0.0:
        level = minus(level, scaled(out, (1.0 - _INWARD) * aside))
    rise = math.asin(min(max(height, -1.0), 1.0))
    if rise > 0.0:
        level = plus(level, scaled(front, height))
        rise = _HIGHEST * math.tanh(rise / _HIGHEST)
    flat = math.sqrt(max(1.0 - math.sin(rise) ** 2, 0.0))
    size = norm(level)
    if size > 0.0:
        level = scaled(level, min(flat / size, 1.0) if rise <= 0.0 else flat / size)
    return unit(plus(level, (0.0, math.sin(rise), 0.0)), way)
