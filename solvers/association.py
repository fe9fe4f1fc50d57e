"""Who is who: detections of one moment are matched to those known from before, all at once.

Source: the assignment problem (Kuhn 1955, "The Hungarian method"), here with gates: what is too far
away is somebody new.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

LOYALTY = 0.5  # [m] that a detection under a known name may lie worse than another
STRANGER = 3.0  # [m] the cost of being somebody new
FURTHEST = 2.5  # [m] beyond which distance makes no difference to one under a known name


def associate(distance: Array, same_name: Bools, within: Bools) -> NDArray[np.int64]:
    """Which known one each detection is, by the least sum of distances.

    Args:
        distance: (D, K) [m] between detections and where the known are expected.
        same_name: (D, K) whether the sensor gives the detection the name that the known one had.
        within: (D, K) whether the two may be the same under different names.

    Returns:
        (D,) index of the known one, or -1 for somebody new.
    """
    # Loading SciPy's optimisation takes longer than most of a show's start, and few need it.
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    detections, known = distance.shape
    cost = np.full((detections, known + detections), 1e6)
    named = np.minimum(distance, FURTHEST) - LOYALTY
    cost[:, :known] = np.where(same_name, named, np.where(within, distance, 1e6))
    cost[:, known:] = STRANGER
    rows, columns = linear_sum_assignment(cost)
    out = np.full(detections, -1, dtype=np.int64)
    out[rows] = np.where(columns < known, columns, -1)
    return out
