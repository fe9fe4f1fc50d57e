"""What moves cannot jump: where points are expected, and what lies too far from there.

A body obeys inertia, and a tracker's faults do not: a point that is lost is put anywhere, and two
limbs whose names are exchanged jump to each other's places. Both are told by how far a point is
from where its motion would have carried it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

DAMPING = 0.8  # share of the last velocity that is expected to go on
FURTHEST_STEP = 0.3  # [m] that is ever expected between two samples

LEAST_APART = 0.12  # [m] between the two limbs of a pair for an exchange to be told
LEAST_WRONG = 0.1  # [m] that exchanged points are from where they are expected
FAR_BETTER = 0.25  # of the squared distance that must be left when the names are exchanged back


def expected(last: Array, velocity: Array, gap: Array) -> Array:
    """Where points (n, 3) [m] should be by now.

    Args:
        last: (n, 3) [m] where they were.
        velocity: (n, 3) [m/s] how they moved then.
        gap: (n,) [s] since then.
    """
    step = velocity * (DAMPING * gap)[:, None]
    length = np.sqrt(np.einsum("ij,ij->i", step, step))
    step *= (FURTHEST_STEP / np.maximum(length, FURTHEST_STEP))[:, None]
    moved: Array = last + step
    return moved


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
    known: Bools = (group >= 0) & np.isfinite(seen[:, 0] + wanted[:, 0])
    known &= known[partner]
    of = np.where(known, group, 0)
    groups = int(group.max(initial=-1)) + 1
    back = seen[partner]

    def total(a: Array, b: Array) -> Array:
        offset = np.where(known[:, None], a - b, 0.0)
        squares: Array = np.einsum("ij,ij->i", offset, offset)
        return np.bincount(of, squares, groups).astype(np.float64)

    count = np.bincount(of, known, groups)
    straight, crossed = total(seen, wanted), total(back, wanted)
    apart = total(wanted, wanted[partner])
    told: Bools = (
        (count > 0)
        & (apart > LEAST_APART**2 * count)
        & (straight > LEAST_WRONG**2 * count)
        & (crossed < FAR_BETTER * straight)
    )
    return told
