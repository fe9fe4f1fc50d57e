"""The One-Euro filter: a low-pass whose cutoff rises with speed; rest is calm, motion prompt.

Source: Casiez, Roussel, Vogel 2012, "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy
Input in Interactive Systems", algorithm 1. One thing differs: the cutoff of a point follows the
length of its velocity, not each coordinate by itself, so that the answer does not depend on how the
axes lie.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]

MIN_CUTOFF = 2.0
"""[Hz] at rest: noise of 30 Hz is reduced to about half, a point that starts has a lag of 80 ms."""

SPEED_COEFFICIENT = 12.0
"""[Hz s/m] the paper's beta: at 1 m/s the cutoff is 14 Hz and the lag 11 ms."""

DERIVATIVE_CUTOFF = 3.0
"""[Hz] of the velocity that sets the cutoff."""


NO_TIME = 1e-6
"""[s] and less between two samples tell no velocity."""

# Of each point: the newest sample, the smoothed one, the smoothed velocity.
_POINT = np.dtype([(name, np.float64, 3) for name in ("raw", "smooth", "velocity")])


@kernel
def smoothing_factor(cutoff: float, dt: float) -> float:
    """The weight of the newest sample in exponential smoothing.

    Args:
        cutoff: [Hz] above 0.
        dt: [s] since the sample before, above 0.
    """
    return 1.0 / (1.0 + 1.0 / (2.0 * np.pi * dt * cutoff))


@dataclass(frozen=True, slots=True, eq=False)
class OneEuroState:
    """The memory of a filter at one moment: an array of `_POINT` (n,), None before any sample."""

    points: NDArray[np.void] | None


class OneEuroFilter:
    """Smooths points that come one sample at a time.

    A constant input comes out unchanged, to the last bit. Of a point that moves evenly with speed v
    the output lags 1 / (2 pi (min_cutoff + speed_coefficient v)) seconds behind.

    Args:
        min_cutoff: [Hz] the cutoff at rest.
        speed_coefficient: [Hz s/m] by how much the cutoff rises with speed.
        derivative_cutoff: [Hz] of the velocity that is used for that.

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
        self._points: NDArray[np.void] | None = None

    @property
    def velocity(self) -> Array | None:
        """(n, 3) [m/s] the smoothed velocity; None before the first sample."""
        return None if self._points is None else self._points["velocity"]

    def reset(self) -> None:
        """Forget every sample; the next one comes out as it is."""
        self._points = None

    def snapshot(self) -> OneEuroState:
        """Return a copy of the filter's memory."""
        return OneEuroState(None if self._points is None else self._points.copy())

    def restore(self, state: OneEuroState) -> None:
        """Go back to a snapshot; the number of points may differ from the current one."""
        self._points = None if state.points is None else state.points.copy()

    def filter(self, points: Array, dt: float) -> Array:
        """Points (n, 3) [m], smoothed.

        Args:
            points: (n, 3) [m], finite; n may not change between samples.
            dt: [s] since the sample before; a sample that took no time changes nothing.

        Raises:
            ValueError: there are not as many points as before.
        """
        if self._points is None:
            self._points = np.zeros(len(points), _POINT)
            self._points["raw"] = self._points["smooth"] = points
        elif points.shape != (len(self._points), 3):
            raise ValueError(f"Expected points {(len(self._points), 3)}, got {points.shape}")
        elif dt > NO_TIME:
            cutoffs = self.min_cutoff, self.speed_coefficient, self.derivative_cutoff
            _smooth(self._points, points, dt, cutoffs)
        return self._points["smooth"].copy()


@kernel
def _smooth(
    memory: NDArray[np.void], samples: Array, dt: float, cutoffs: tuple[float, float, float]
) -> None:
    least, coefficient, of_velocity = cutoffs
    weight = smoothing_factor(of_velocity, dt)
    for index, point in enumerate(memory):
        sample = samples[index]
        slope = (sample - point.raw) / dt
        point.velocity += weight * (slope - point.velocity)
        speed = np.sqrt((point.velocity**2).sum())
        share = smoothing_factor(least + coefficient * speed, dt)
        point.smooth += share * (sample - point.smooth)
        point.raw[:] = sample
