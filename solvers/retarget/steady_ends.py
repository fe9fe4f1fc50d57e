"""Steadies hands, feet and heads that flip, as depth cameras' do, and lets all others be.

A hand is a short bone: noise of a few centimetres turns it by 70 degrees from one frame to the
next. What turns slowly enough for a hand passes unchanged. What turns faster is followed within a
tenth of a second, so that a flip of one frame shows as a twitch, and one that lasts as a turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.vector import dot, minus, norm, point, scaled, unit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

CALM, WILD = math.radians(20.0), math.radians(45.0)  # from all to nothing passes at once
SECONDS = 0.1  # [s] in which the rest is followed
LONGEST = 0.25  # [s] between two frames: after a longer gap all passes
_EVEN = 1.0 / 30.0  # [s] a frame that lasts less may turn by less


@dataclass(frozen=True, slots=True, eq=False)
class SteadyEndsState:
    """The memory of a `SteadyEnds`: (E, 3) unit directions, and the newest time [s] or NaN."""

    ways: Array
    time: float


class SteadyEnds:
    """Steadies E bones at the ends of limbs.

    Args:
        near, far: (E,) joints at which each begins and ends.
    """

    def __init__(self, near: Sequence[int], far: Sequence[int]) -> None:
        self._near, self._far = (np.array(each, dtype=np.int64) for each in (near, far))
        self._ways = np.zeros((len(self._near), 3))
        self._time = math.nan

    def reset(self) -> None:
        """Forget all frames."""
        self._time = math.nan

    def snapshot(self) -> SteadyEndsState:
        """Return a copy of what the next frame depends on."""
        return SteadyEndsState(self._ways.copy(), self._time)

    def restore(self, state: SteadyEndsState) -> None:
        """Go back to a snapshot of as many bones."""
        self._ways[:], self._time = state.ways, state.time

    def steady(self, joints: Array, time: float) -> None:
        """Move the far ends of the bones in `joints` (J, 3) [m] to where they are steady.

        Args:
            joints: is changed; the lengths of the bones are kept.
            time: [s]. If it steps back or leaps ahead, or is NaN, all passes.
        """
        dt = time - self._time
        if not 0.0 <= dt <= LONGEST:
            dt = math.inf
        self._time = time
        _steady(joints, self._near, self._far, self._ways, dt)


@kernel
def _steady(joints: Array, near: Ints, far: Ints, ways: Array, dt: float) -> None:
    for end in range(len(near)):
        start = point(joints, near[end])
        gap = minus(point(joints, far[end]), start)
        length = norm(gap)
        if length <= 0.0:
            continue
        way, before = scaled(gap, 1.0 / length), point(ways, end)
        if dt < math.inf and dot(before, before) > 0.5:
            angle = math.acos(min(max(dot(way, before), -1.0), 1.0))
            frame = min(dt / _EVEN, 1.0)
            wild = min(max((angle / max(frame, 1e-9) - CALM) / (WILD - CALM), 0.0), 1.0)
            share = 1.0 - wild * math.exp(-dt / SECONDS)
            if share < 1.0:
                way = _between(before, way, angle, share)
                for k in range(3):
                    joints[far[end], k] = start[k] + length * way[k]
        ways[end, 0], ways[end, 1], ways[end, 2] = way


@kernel
def _between(
    a: tuple[float, float, float], b: tuple[float, float, float], angle: float, share: float
) -> tuple[float, float, float]:
    """The unit vector at a share of the angle from a to b; `a` where they are opposite."""
    sine = math.sin(angle)
    if sine < 1e-6:
        return a
    first, second = math.sin((1.0 - share) * angle) / sine, math.sin(share * angle) / sine
    middle = (
        first * a[0] + second * b[0],
        first * a[1] + second * b[1],
        first * a[2] + second * b[2],
    )
    return unit(middle, a)
