"""What moves cannot jump: where points are expected, and what lies too far from there.

A body obeys inertia, and a tracker's faults do not: a point that is lost is put anywhere, and two
limbs whose names are exchanged jump to each other's places. Both are told by how far a point is
from where its motion would have carried it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

DAMPING = 0.8  # share of the last velocity that is expected to go on
FURTHEST_STEP = 0.3  # [m] that is ever expected between two samples

LEAST_APART = 0.12  # [m] between the two limbs of a pair for an exchange to be told
LEAST_WRONG = 0.1  # [m] that exchanged points are from where they are expected
FAR_BETTER = 0.25  # of the squared distance that must be left when the names are exchanged back


@kernel
def expect(last: Array, velocity: Array, gap: float, wanted: Array) -> None:
    """Where a point should be by now.

    Args:
        last: (3,) [m] where it was.
        velocity: (3,) [m/s] how it moved then.
        gap: [s] since then.
        wanted: (3,) [m] takes the answer.
    """
    go_on = DAMPING * gap
    speed = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    go_on *= FURTHEST_STEP / max(speed * abs(go_on), FURTHEST_STEP)
    for axis in range(3):
        wanted[axis] = last[axis] + velocity[axis] * go_on


@kernel
def distance(a: Array, b: Array) -> float:
    """How far apart two points (3,) are; NaN where one is unknown."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return np.sqrt(x * x + y * y + z * z)  # type: ignore[no-any-return]


@kernel
def exchanged(seen: Array, wanted: Array, partner: Indices, group: Indices) -> Bools:
    """Which groups of points stand where their partners should stand, and the other way round.

    Args:
        seen: (n, 3) [m]; NaN where unknown.
        wanted: (n, 3) [m] where they are expected; NaN where nothing is.
        partner: (n,) the point on the other side; itself in the middle.
        group: (n,) from 0, which limb pair a point is of; -1 for none.

    Returns:
        (G,) for each group whether putting its points back is far better than leaving them.
    """
    groups = group.max() + 1
    straight, crossed, apart = np.zeros(groups), np.zeros(groups), np.zeros(groups)
    count = np.zeros(groups)
    for point, of in enumerate(group):
        other = partner[point]
        # Not isfinite of a sum: x - x in it may be reordered until a NaN is lost.
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
