"""Matches the bodies that a sensor detects in one frame to the bodies known from before.

Source: the assignment problem (Kuhn 1955, "The Hungarian method"), with gates: a detection too far
from every known body is a new body.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

KNOWN_NAME_BONUS = 0.5  # [m] by which a body with the same name may be farther away
NEW_COST = 3.0  # [m] the cost of a new body
FARTHEST = 2.5  # [m] the most that distance costs under the same name


def associate(distance: Array, same_name: Bools, within: Bools) -> NDArray[np.int64]:
    """Return the known body of each detection, by the least sum of distances.

    Args:
        distance: (D, K) [m] between detections and the expected places of known bodies.
        same_name: (D, K) whether the sensor gives both the same name.
        within: (D, K) whether both may be the same body under different names.

    Returns:
        (D,) index of the known body, or -1 for a new body.
    """
    detections, known = distance.shape
    cost = np.full((detections, known + detections), 1e6)
    named = np.minimum(distance, FARTHEST) - KNOWN_NAME_BONUS
    cost[:, :known] = np.where(same_name, named, np.where(within, distance, 1e6))
    cost[:, known:] = NEW_COST
    # scipy.optimize has a solver, too, but takes 0.3 s to load. In this one a cost of zero means no
    # edge. Every detection has one partner, so a constant added to all costs changes nothing.
    rows, columns = min_weight_full_bipartite_matching(csr_array(cost + 2.0 * KNOWN_NAME_BONUS))
    out = np.full(detections, -1, dtype=np.int64)
    out[rows] = np.where(columns < known, columns, -1)
    return out
