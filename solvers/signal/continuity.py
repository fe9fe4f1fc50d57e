"""Predicts where tracked points should be, and finds limbs whose names a tracker exchanged.

A body obeys inertia; the faults of a tracker do not. A lost point may appear anywhere, and two
limbs with exchanged names jump to each other's places. Both faults show as a large distance from
the place predicted by the last motion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

DAMPING = 0.8  # share of the last velocity that is expected to continue
FURTHEST_STEP = 0.3  # [m] the largest expected step between two samples

LEAST_APART = 0.12  # [m] the least distance of the limbs of a pair for an exchange to be found
LEAST_WRONG = 0.1  # [m] the least distance of exchanged points from their expected places
FAR_BETTER = 0.25  # the most of the squared distance that is left after exchanging the names back


@kernel
def expect(last: Array, velocity: Array, gap: float, wanted: Array) -> None:
    """Write the expected place of a point to `wanted`.

    Args:
        last: (3,) [m] its last place.
        velocity: (3,) [m/s] its last velocity.
        gap: [s] since then.
        wanted: (3,) [m].
    """
    go_on = DAMPING * gap
    speed = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    go_on *= FURTHEST_STEP / max(speed * abs(go_on), FURTHEST_STEP)
    for axis in range(3):
        wanted[axis] = last[axis] + velocity[axis] * go_on


@kernel
def distance(a: Array, b: Array) -> float:
    """The distance of two points (3,); NaN where one is unknown."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return np.sqrt(x * x + y * y + z * z)  # type: ignore[no-any-return]  # numpy says Any of a scalar root


@kernel
def exchanged(seen: Array, wanted: Array, partner: Indices, group: Indices) -> Bools:
    """Find the groups whose left and right points are at each other's expected places.

    Args:
        seen: (n, 3) [m]; NaN where unknown.
        wanted: (n, 3) [m] the expected places; NaN where unknown.
        partner: (n,) the point on the other side of the body; the point itself in the middle.
        group: (n,) the limb pair of each point, from 0; -1 for none.

    Returns:
        (G,) for each group whether exchanging its points back fits far better.
    """
    groups = group.max() + 1
    straight, crossed, apart = np.zeros(groups), np.zeros(groups), np.zeros(groups)
    count = np.zeros(groups)
    for point, of in enumerate(group):
        other = partner[point]
        # Not isfinite of a sum: reordering may cancel x - x, and with it a NaN.
        off = distance(seen[point], wanted[point])
        if of < 0 or np.isnan(off) or np.isnan(distance(seen[other], wanted[other])):
            continue
        count[of] += 1
        straight[of] += off**2
        crossed[of] += distance(seen[other], wanted[point]) ** 2
        apart[of] += distance(wanted[point], wanted[other]) ** 2
    told: Bools = (
        (count > 0)
        & (apart > LEAST_APART**2 * count)
        & (straight > LEAST_WRONG**2 * count)
        & (crossed < FAR_BETTER * straight)
    )
    return told
