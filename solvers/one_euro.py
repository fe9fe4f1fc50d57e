"""The One-Euro filter: a low-pass whose cutoff rises with speed; rest is calm, motion prompt.

Source: Casiez, Roussel, Vogel 2012, "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy
Input in Interactive Systems", algorithm 1. One thing differs: the cutoff of a point follows the
length of its velocity, not each coordinate by itself, so that the answer does not depend on how the
axes lie.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MIN_CUTOFF = 2.0
"""[Hz] at rest: noise of 30 Hz is reduced to about half, a point that starts has a lag of 80 ms."""

SPEED_COEFFICIENT = 12.0
"""[Hz s/m] the paper's beta: at 1 m/s the cutoff is 14 Hz and the lag 11 ms."""

DERIVATIVE_CUTOFF = 3.0
"""[Hz] of the velocity that sets the cutoff."""


NO_TIME = 1e-6
"""[s] and less between two samples tell no velocity."""


def smoothing_factor(cutoff: Array | float, dt: float) -> Array:
    """The weight of the newest sample in exponential smoothing.

    Args:
        cutoff: [Hz] any shape, above 0.
        dt: [s] since the sample before, above 0.
    """
    factor: Array = np.asarray(1.0 / (1.0 + 1.0 / (2.0 * np.pi * dt * np.asarray(cutoff))))
    return factor


class OneEuroFilter:
    """Smooths points that come one sample at a time.

    A constant input comes out unchanged, to the last bit. Of a point that moves evenly with speed v
    the output lags 1 / (2 pi (min_cutoff + speed_coefficient v)) seconds behind.

    Args:
        min_cutoff: [Hz] the cutoff at rest.
        speed_coefficient: [Hz s/m] by how much the cutoff rises with speed.
        derivative_cutoff: [Hz] of the velocity that is used for that.

    Attributes:
        velocity: (n, 3) [m/s] the smoothed velocity; None before the first sample.
    """

    def __init__(
        self,
        min_cutoff: float = MIN_CUTOFF,
        speed_coefficient: float = SPEED_COEFFICIENT,
        derivative_cutoff: float = DERIVATIVE_CUTOFF,
    ) -> None:
        self.min_cutoff = min_cutoff
        self.speed_coefficient = speed_coefficient
        self.derivative_cutoff = derivative_cutoff
        self.velocity: Array | None = None
        self._raw: Array | None = None
        self._smooth: Array | None = None

    def reset(self) -> None:
        """Forget every sample; the next one comes out as it is."""
        self.velocity = self._raw = self._smooth = None

    def filter(self, points: Array, dt: float) -> Array:
        """Points (n, 3) [m], smoothed.

        Args:
            points: (n, 3) [m], finite; n may not change between samples.
            dt: [s] since the sample before; a sample that took no time changes nothing.
        """
        if self._raw is None or self._smooth is None or self.velocity is None:
            self._raw = self._smooth = points.copy()
            self.velocity = np.zeros_like(points)
        elif dt > NO_TIME:
            slope = (points - self._raw) / dt
            weight = smoothing_factor(self.derivative_cutoff, dt)
            self.velocity = self.velocity + weight * (slope - self.velocity)
            speed = np.sqrt(np.einsum("ij,ij->i", self.velocity, self.velocity))
            cutoff = self.min_cutoff + self.speed_coefficient * speed
            weight = smoothing_factor(cutoff, dt)[:, None]
            self._smooth = self._smooth + weight * (points - self._smooth)
            self._raw = points.copy()
        return self._smooth
