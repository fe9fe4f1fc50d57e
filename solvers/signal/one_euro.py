"""The One-Euro filter: a low-pass filter of points whose cutoff rises with speed.

Points at rest are smoothed strongly, and fast points follow with little delay.

Source: Casiez, Roussel, Vogel 2012, "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy
Input in Interactive Systems", algorithm 1. One difference: the cutoff of a point follows the length
of its velocity, not each coordinate, so the result does not depend on the axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.short_loops import put

Array = NDArray[np.float64]

MIN_CUTOFF = 2.0
"""[Hz] at rest: 30 Hz noise is reduced to about half; a point that starts has a lag of 80 ms."""

SPEED_COEFFICIENT = 12.0
"""[Hz s/m] the paper's beta: at 1 m/s the cutoff is 14 Hz and the lag 11 ms."""

DERIVATIVE_CUTOFF = 3.0
"""[Hz] of the velocity that sets the cutoff."""


NO_TIME = 1e-6
"""[s]: so short a time between two samples gives no velocity."""

# Of each point: the newest sample, the smoothed one, the smoothed velocity.
_POINT = np.dtype([(name, np.float64, 3) for name in ("raw", "smooth", "velocity")])


@kernel
def smoothing_factor(cutoff: float, dt: float) -> float:
    """Return the weight of the newest sample in exponential smoothing.

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
    """Smooths points, one sample at a time.

    A constant input stays unchanged, to the last bit. For a point of constant speed v the output
    lags by 1 / (2 pi (min_cutoff + speed_coefficient v)) seconds.

    Args:
        min_cutoff: [Hz] the cutoff at rest.
        speed_coefficient: [Hz s/m] the rise of the cutoff with speed.
        derivative_cutoff: [Hz] the cutoff of the velocity from which the speed is taken.
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
        """The smoothed velocity (n, 3) [m/s]; None before the first sample."""
        return None if self._points is None else self._points["velocity"]

    def reset(self) -> None:
        """Forget all samples; the next one stays unchanged."""
        self._points = None

    def snapshot(self) -> OneEuroState:
        """Return a copy of the filter's memory."""
        return OneEuroState(None if self._points is None else self._points.copy())

    def restore(self, state: OneEuroState) -> None:
        """Go back to a snapshot; the number of points may differ from the current one."""
        self._points = None if state.points is None else state.points.copy()

    def filter(self, points: Array, dt: float) -> Array:
        """Return the smoothed points (n, 3) [m].

        Args:
            points: (n, 3) [m], finite; n may not change between samples.
            dt: [s] since the last sample; at 0 the sample has no effect.

        Raises:
            ValueError: the number of points has changed.
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
        put(point.raw, sample)
