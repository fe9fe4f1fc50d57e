"""Where points will be a moment later: their velocity, smoothed, goes on and is damped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.signal.one_euro import NO_TIME, smoothing_factor

Array = NDArray[np.float64]

VELOCITY_CUTOFF = 6.0  # [Hz]
GOES_ON = 0.7  # share of the velocity that is expected to go on
MOST = 1.0 / 30.0  # [s] ahead


@dataclass(frozen=True, slots=True, eq=False)
class PredictorState:
    """The memory of a predictor at one moment.

    Attributes:
        before: (n, 3) [m] the last sample, None before any.
        velocity: (n, 3) [m/s] smoothed, None before any sample.
        step: [s] by which the last answer lay ahead.
    """

    before: Array | None
    velocity: Array | None
    step: float


class Predictor:
    """Predicts points one step ahead.

    A point at rest stays where it is, to the last bit.
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
        """Points (n, 3) [m] as they will be one step later.

        Args:
            points: (n, 3) [m], finite.
            dt: [s] since the sample before, which the next is expected to take too.

        Raises:
            ValueError: there are not as many points as before.
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
    """Smooth the velocity (n, 3) of points (n, 3) that were `before`."""
    weight = smoothing_factor(VELOCITY_CUTOFF, dt)
    for i in range(len(points)):
        for axis in range(3):
            slope = (points[i, axis] - before[i, axis]) / dt
            velocity[i, axis] += weight * (slope - velocity[i, axis])
