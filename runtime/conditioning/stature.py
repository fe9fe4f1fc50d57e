"""How tall a performer is beside the skeleton's rest pose, measured while they begin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

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
        self._ratios: list[float] = []
        self._until = float("nan")

    def watch(self, positions: Array, filled: Bools, time: float) -> None:
        """Measure positions (J, 3) [m], `filled` (J,) being guesses, for the first second."""
        if time > self._until:
            return
        both = ~(filled[self._far] | filled[self._near])
        if not both.any():
            return
        if np.isnan(self._until):
            self._until = time + SECONDS
        ends = positions[self._far[both]] - positions[self._near[both]]
        self._ratios.append(float(np.median(np.linalg.norm(ends, axis=1) / self._rest[both])))
        ratio = float(np.median(self._ratios))
        self.factor = 1.0
        if abs(ratio - 1.0) > SAME:
            self.factor = 1.0 / float(np.clip(ratio, 1.0 / MOST, MOST))
