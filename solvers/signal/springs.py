"""Damped springs: numbers that follow their targets with a small overshoot.

Each step is the exact solution for a target that is constant during the step. So steps of any
length are stable, and two short steps equal one long step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SpringsState:
    """Positions (n,) and speeds (n,) [1/s] of springs at one moment."""

    at: Array
    speed: Array


class Springs:
    """Equal springs, at rest at the start.

    Args:
        start: (n,) initial positions.
        frequency: [1/s] of the undamped spring.
        damping: share of the critical damping, in (0, 1).

    Attributes:
        at: (n,) current positions.
        speed: (n,) [1/s] current speeds.
    """

    def __init__(self, start: ArrayLike, *, frequency: float, damping: float) -> None:
        self.at: Array = np.array(start, dtype=np.float64)
        self.speed: Array = np.zeros_like(self.at)
        self._omega = 2.0 * math.pi * frequency
        self._damping = damping

    def snapshot(self) -> SpringsState:
        """Return a copy of the current positions and speeds."""
        return SpringsState(self.at.copy(), self.speed.copy())

    def restore(self, state: SpringsState) -> None:
        """Go back to a snapshot of as many springs."""
        self.at[:], self.speed[:] = state.at, state.speed

    def step(self, target: ArrayLike, seconds: float) -> Array:
        """Return the positions (n,) after `seconds` [s] of pull to `target` (n,).

        The next step overwrites the array.
        """
        goal = np.ascontiguousarray(target, dtype=np.float64)
        decay = self._damping * self._omega
        turn = self._omega * math.sqrt(1.0 - self._damping**2)
        fade = math.exp(-decay * seconds)
        cosine, sine = fade * math.cos(turn * seconds), fade * math.sin(turn * seconds) / turn
        _step(self.at, self.speed, goal, (cosine, sine, decay, self._omega**2))
        return self.at


@kernel
def _step(at: Array, speed: Array, goal: Array, factors: tuple[float, float, float, float]) -> None:
    cosine, sine, decay, stiffness = factors
    for i in range(len(at)):
        away, fast = at[i] - goal[i], speed[i]
        speed[i] = cosine * fast - sine * (stiffness * away + decay * fast)
        at[i] = goal[i] + cosine * away + sine * (fast + decay * away)
