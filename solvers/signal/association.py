"""Who is who: detections of one moment are matched to those known from before, all at once.

Source: the assignment problem (Kuhn 1955, "The Hungarian method"), here with gates: what is too far
away is somebody new.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

KNOWN_NAME_BONUS = 0.5  # [m] that a detection under a known name may lie worse than another
NEW_COST = 3.0  # [m] the cost of being somebody new
FARTHEST = 2.5  # [m] beyond which distance makes no difference to one under a known name


def associate(distance: Array, same_name: Bools, within: Bools) -> NDArray[np.int64]:
    """Which known one each detection is, by the least sum of distances.

    Args:
        distance: (D, K) [m] between detections and where the known are expected.
        same_name: (D, K) whether the sensor gives the detection the name that the known one had.
        within: (D, K) whether the two may be the same under different names.

    Returns:
        (D,) index of the known one, or -1 for somebody new.
    """
    detections, known = distance.shape
    cost = np.full((detections, known + detections), 1e6)
    named = np.minimum(distance, FARTHEST) - KNOWN_NAME_BONUS
    cost[:, :known] = np.where(same_name, named, np.where(within, distance, 1e6))
    cost[:, known:] = NEW_COST
    # Not by scipy.optimize, which takes 0.3 s to load. Here no cost may be zero, since that is no
    # edge; every detection has one partner, so what is added to all costs changes nothing.
    rows, columns = min_weight_full_bipartite_matching(csr_array(cost + 2.0 * KNOWN_NAME_BONUS))
    out = np.full(detections, -1, dtype=np.int64)
    out[rows] = np.where(columns < known, columns, -1)
    return out
