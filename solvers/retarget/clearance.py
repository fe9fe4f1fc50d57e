"""How far a performer is above the floor: nothing while any part of the body rests on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]

# In heights of the performer.
STANDS = 0.02  # a foot no higher above the place where it stands counts as standing: noise
JUMPS = 0.04  # from here on the clearance is the whole height of a jump
FLESH = 0.05  # around the joints of trunk, arms and legs, which lie, sit or kneel on it

TUCK = 2.0  # times the rise of the trunk: what legs that are drawn up add to a jump


def clearance(feet: Array, joints: Array, floor: float, stature: float, rise: float) -> float:
    """Return how far a performer is above the floor [m]; 0 while they stand, sit, kneel or lie.

    It rises smoothly between the two limits above, and never jumps where the heights do not.

    Args:
        feet: (F, 2) [m] of ankles and toes above the height at which they stand: see
            `FootContacts.heights`. F may be 0.
        joints: (J, 3) [m] the other joints of trunk, head, arms and legs, down to the knees. None
            of the feet, and none that stays on the floor while the body jumps.
        floor: [m] the height of the floor; see `FootContacts.floors`.
        stature: [m] the height of the performer, standing.
        rise: [m] how much higher the trunk is than when a foot stood last. Feet that a camera sees
            higher than they are, and those of a body whose hips it keeps in place, make no jump.
    """
    return _clearance(feet, joints, floor, stature, rise)


@kernel
def _clearance(feet: Array, joints: Array, floor: float, stature: float, rise: float) -> float:
    above = np.inf
    for foot in range(len(feet)):
        above = min(above, feet[foot, 0], feet[foot, 1])
    for joint in range(len(joints)):
        above = min(above, joints[joint, 1] - floor - FLESH * stature)
    above = min(above, TUCK * rise)
    share = (above / stature - STANDS) / (JUMPS - STANDS)
    share = min(max(share, 0.0), 1.0)
    return max(above, 0.0) * share * share * (3.0 - 2.0 * share)
