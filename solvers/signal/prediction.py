"""Predicts points one sample ahead from their smoothed and damped velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.signal.one_euro import NO_TIME, smoothing_factor

Array = NDArray[np.float64]

VELOCITY_CUTOFF = 6.0  # [Hz]
GOES_ON = 0.7  # share of the velocity that is expected to continue
MOST = 1.0 / 30.0  # [s] the farthest prediction


@dataclass(frozen=True, slots=True, eq=False)
class PredictorState:
    """The memory of a predictor at one moment.

    Attributes:
        before: (n, 3) [m] the last sample, None before any.
        velocity: (n, 3) [m/s] smoothed, None before any sample.
        step: [s] how far ahead the last prediction was.
    """

    before: Array | None
    velocity: Array | None
    step: float


class Predictor:
    """Predicts points one step ahead.

    A point at rest stays in place, to the last bit.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all motion."""
        self._before: Array | None = None
        self._velocity: Array | None = None
        self._step = 0.0

    def snapshot(self) -> PredictorState:
        """Return a copy of the predictor's memory."""
        return PredictorState(_copied(self._before), _copied(self._velocity), self._step)

    def restore(self, state: PredictorState) -> None:
        """Go back to a snapshot; the number of points may differ from the current one."""
        self._before, self._velocity = _copied(state.before), _copied(state.velocity)
        self._step = state.step

    def predict(self, points: Array, dt: float) -> Array:
        """Return the points (n, 3) [m] as predicted for one sample later.

        Args:
            points: (n, 3) [m], finite.
            dt: [s] since the last sample; the next is expected after the same time.

        Raises:
            ValueError: the number of points has changed.
        """
        if self._before is None or self._velocity is None:
            self._before, self._velocity = points.copy(), np.zeros_like(points)
        elif points.shape != self._before.shape:
            raise ValueError(f"Expected points {self._before.shape}, got {points.shape}")
        elif dt > NO_TIME:
            self._step = min(dt, MOST)
            _follow(points, self._before, self._velocity, dt)
        self._before[:] = points
        ahead: Array = points + self._velocity * (GOES_ON * self._step)
        return ahead


def _copied(points: Array | None) -> Array | None:
    return None if points is None else points.copy()


@kernel
def _follow(points: Array, before: Array, velocity: Array, dt: float) -> None:
    """Update the smoothed velocity (n, 3) of points (n, 3) from their places `before`."""
    weight = smoothing_factor(VELOCITY_CUTOFF, dt)
    for i in range(len(points)):
        for axis in range(3):
            slope = (points[i, axis] - before[i, axis]) / dt
            velocity[i, axis] += weight * (slope - velocity[i, axis])
