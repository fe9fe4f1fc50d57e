"""Replace invalid numbers in a frame that was received from another machine."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import exact_kernel

Array = NDArray[np.float64]

_UNIT = 1e-6  # largest deviation from 1 of the length of a unit quaternion
_LARGEST = 1e6  # largest component of a quaternion


@exact_kernel
def make_safe(positions: Array, confidence: Array, quaternions: Array) -> None:
    """Correct impossible numbers in place.

    Args:
        positions: (J, 3) [m]; set to NaN where a coordinate is not finite.
        confidence: (J,) clipped to [0, 1]; set to 0 where there is no position.
        quaternions: (J, 4), or (0, 4) if there are none. Unit quaternions keep every bit, others
            are normalised, or set to NaN where that is impossible.
    """
    for joint in range(len(positions)):
        x, y, z = positions[joint]
        if math.isfinite(x) and math.isfinite(y) and math.isfinite(z):
            sure = confidence[joint]
            confidence[joint] = 0.0 if math.isnan(sure) else min(max(sure, 0.0), 1.0)
        else:
            positions[joint] = np.nan
            confidence[joint] = 0.0
    for joint in range(len(quaternions)):
        x, y, z, w = quaternions[joint]
        length = math.sqrt(x * x + y * y + z * z + w * w)
        if not (np.abs(quaternions[joint]) <= _LARGEST).all() or length < _UNIT:
            quaternions[joint] = np.nan
        elif abs(length - 1.0) > _UNIT:
            for axis in range(4):
                quaternions[joint, axis] /= length
