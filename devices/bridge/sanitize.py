"""What the numbers of a frame from another machine may be, whatever they say."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from devices.compiled import kernel

Array = NDArray[np.float64]

_UNIT = 1e-6  # how far from 1 the length of a unit quaternion may be
_LARGEST = 1e6  # of a quaternion's numbers


@kernel
def make_safe(positions: Array, confidence: Array, quaternions: Array) -> None:
    """Put right, in place, what no sensor says.

    Args:
        positions: (J, 3) [m]; NaN where one of the three is not finite.
        confidence: (J,) into [0, 1], 0 where there is no position.
        quaternions: (J, 4), or (0, 4) where there are none. Unit ones stay to the last bit, others
            are made so, NaN where that cannot be.
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
            quaternions[joint] /= length
