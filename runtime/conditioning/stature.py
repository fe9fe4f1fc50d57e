"""How tall a performer is beside the skeleton's rest pose, measured while they begin."""

from __future__ import annotations

import math
from statistics import median

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from solvers.kernels.compiled import kernel
from solvers.signal.continuity import distance

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

SECONDS = 1.0  # [s] that are measured; after them nobody grows
LEAST_BONE = 0.05  # [m] at rest; shorter ones are mostly noise
SAME = 0.02  # that is no difference
MOST = 3.0  # times as tall, or as small


class Stature:
    """Measures one performer.

    Args:
        skeleton: whose rest pose everybody is brought to.

    Attributes:
        factor: what positions are multiplied by.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        rest, parents = skeleton.rest_positions, skeleton.parents
        length = np.linalg.norm(rest - rest[np.where(parents < 0, 0, parents)], axis=1)
        self._far = np.flatnonzero((parents >= 0) & (length > LEAST_BONE))
        self._near = parents[self._far]
        self._rest = length[self._far]
        self.forget()

    def forget(self) -> None:
        """Measure anew."""
        self.factor = 1.0
        self._sizes: list[float] = []
        self._until = float("nan")

    def watch(self, positions: Array, filled: Bools, time: float) -> None:
        """Measure positions (J, 3) [m], `filled` (J,) being guesses, for the first second."""
        if time > self._until:
            return
        size = _size(positions, filled, self._far, self._near, self._rest)
        if math.isnan(size):
            return
        if math.isnan(self._until):
            self._until = time + SECONDS
        self._sizes.append(size)
        size = median(self._sizes)
        self.factor = 1.0
        if abs(size - 1.0) > SAME:
            self.factor = 1.0 / min(max(size, 1.0 / MOST), MOST)


@kernel
def _size(positions: Array, filled: Bools, far: Indices, near: Indices, rest: Array) -> float:
    """How many times as long as at rest the bones are in the middle; NaN where none was seen."""
    ratios = np.empty(len(rest))
    seen = 0
    for bone, length in enumerate(rest):
        if not (filled[far[bone]] or filled[near[bone]]):
            ratios[seen] = distance(positions[far[bone]], positions[near[bone]]) / length
            seen += 1
    return float(np.median(ratios[:seen])) if seen > 0 else np.nan
