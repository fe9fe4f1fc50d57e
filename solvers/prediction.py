"""Where points will be a moment later: their velocity, smoothed, goes on and is damped."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.one_euro import NO_TIME, smoothing_factor

Array = NDArray[np.float64]

VELOCITY_CUTOFF = 6.0  # [Hz]
GOES_ON = 0.7  # share of the velocity that is expected to go on
MOST = 1.0 / 30.0  # [s] ahead


class Predictor:
    """Predicts points one step ahead.

    A point at rest stays where it is, to the last bit.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all motion."""
        self._before: Array | None = None
        self._velocity: Array | float = 0.0
        self._step = 0.0

    def predict(self, points: Array, dt: float) -> Array:
        """Points (n, 3) [m] as they will be one step later.

        Args:
            points: (n, 3) [m], finite.
            dt: [s] since the sample before, which the next is expected to take too.
        """
        if self._before is not None and dt > NO_TIME:
            slope = (points - self._before) / dt
            weight = smoothing_factor(VELOCITY_CUTOFF, dt)
            self._step = min(dt, MOST)
            self._velocity = self._velocity + weight * (slope - self._velocity)
        self._before = points.copy()
        ahead: Array = points + self._velocity * (GOES_ON * self._step)
        return ahead
