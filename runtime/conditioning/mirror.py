"""The mirror: left is right, in names and in space, so that the limbs do not cross."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ACROSS = np.array([-1.0, 1.0, 1.0])


def mirrored(positions: Array, partner: NDArray[np.int64]) -> Array:
    """Positions (J, 3) [m] as in a mirror that the performer faces; twice is as before.

    Args:
        positions: (J, 3).
        partner: (J,) the same joint of the other side; itself in the middle.
    """
    seen: Array = positions[partner] * ACROSS
    return seen
