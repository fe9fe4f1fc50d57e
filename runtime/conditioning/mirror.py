"""Exchange of left and right, in joint names and in space, so that the limbs do not cross."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ACROSS = np.array([-1.0, 1.0, 1.0])


def mirrored(positions: Array, partner: NDArray[np.int64]) -> Array:
    """Return positions (J, 3) [m] as in a mirror that the performer faces; twice restores them.

    Args:
        positions: (J, 3) [m].
        partner: (J,) the same joint of the other side; a joint in the middle is its own.
    """
    seen: Array = positions[partner] * ACROSS
    return seen


def mirrored_rotations(rotations: Array, partner: NDArray[np.int64]) -> Array:
    """Return rotations (J, 4), world, as in the same mirror."""
    seen: Array = rotations[partner] * np.array([1.0, -1.0, -1.0, 1.0])
    return seen
