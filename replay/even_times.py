"""Resample motion at evenly spaced times, for formats with one time step for all frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError

Array = NDArray[np.float64]

MOST_TIMES = 2_000_000  # 9 hours at 60 Hz
_LENGTHEN = 16  # largest factor by which gaps may increase the number of frames


@dataclass(frozen=True, slots=True, eq=False)
class EvenTimes:
    """Evenly spaced times in terms of the given ones.

    Attributes:
        step: between two even times [s].
        after: (N,) index of the given time at or after each even time.
        share: (N,) in [0, 1]: position of each even time between the given times before and after.
    """

    step: float
    after: NDArray[np.int64]
    share: Array

    def vectors(self, values: Array) -> Array:
        """Interpolate values (T, ...) linearly at the even times (N, ...)."""
        weight = self.share.reshape(-1, *[1] * (values.ndim - 1))
        blended: Array = (1 - weight) * values[self.after - 1] + weight * values[self.after]
        return blended

    def rotations(self, quaternions: Array) -> Array:
        """Interpolate unit quaternions (T, ..., 4) linearly on the shorter arc, and normalise."""
        before, after = quaternions[self.after - 1], quaternions[self.after]
        opposite = np.sum(before * after, axis=-1, keepdims=True) < 0
        weight = self.share.reshape(-1, *[1] * (quaternions.ndim - 1))
        blended = (1 - weight) * before + weight * np.where(opposite, -after, after)
        blended /= np.maximum(np.linalg.norm(blended, axis=-1, keepdims=True), 1e-12)
        return blended


def even_times(times: Array, rate: float | None = None) -> EvenTimes | None:
    """Return even times from the first to the last of `times`; None for fewer than two.

    Args:
        times: (T,) [s] of the frames, rising.
        rate: frames per second; by default that of the median step. A recording with gaps gets at
            most 16 times its number of frames.

    Raises:
        InputError: there would be more than `MOST_TIMES`.
    """
    if len(times) < 2:
        return None
    span = float(times[-1] - times[0])
    if rate is None:
        # A slightly adjusted step keeps the last frame.
        usual = max(float(np.median(np.diff(times))), span / (_LENGTHEN * len(times)))
        count = max(round(span / usual), 1)
        step = span / count
    else:
        step = 1.0 / rate
        count = int(span / step + 1e-6)
    if count > MOST_TIMES:
        raise InputError(f"{count + 1} frames are too many; give a lower rate")
    even = times[0] + np.minimum(step * np.arange(count + 1), span)
    after = np.clip(np.searchsorted(times, even), 1, len(times) - 1)
    share = (even - times[after - 1]) / (times[after] - times[after - 1])
    return EvenTimes(step, after, share)
