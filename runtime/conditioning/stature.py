"""The size of a performer relative to the skeleton's rest pose, from their first second."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from solvers.kernels.compiled import kernel
from solvers.kernels.short_loops import median
from solvers.signal.continuity import distance

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

SECONDS = 1.0  # [s] that are measured; the size is fixed afterwards
LEAST_BONE = 0.05  # [m] at rest; shorter ones are mostly noise
SAME = 0.02  # a smaller difference counts as none
MOST = 3.0  # the largest factor, and one over the smallest


@dataclass(frozen=True, slots=True)
class StatureState:
    """The measurements of one performer.

    Attributes:
        factor: the factor that came of them.
        sizes: one size for each frame measured.
        until: [s] when measuring ends; NaN before the first frame.
    """

    factor: float
    sizes: tuple[float, ...]
    until: float


class Stature:
    """Measures one performer.

    Args:
        skeleton: its rest pose gives the size that every performer is scaled to.

    Attributes:
        factor: multiplied by it, the performer's positions have that size.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        rest, parents = skeleton.rest_positions, skeleton.parents
        length = np.linalg.norm(rest - rest[np.where(parents < 0, 0, parents)], axis=1)
        self._far = np.flatnonzero((parents >= 0) & (length > LEAST_BONE))
        self._near = parents[self._far]
        self._rest = length[self._far]
        self.forget()

    def forget(self) -> None:
        """Measure anew from the next frame on."""
        self.factor = 1.0
        self._sizes: list[float] = []
        self._until = float("nan")

    def snapshot(self) -> StatureState:
        """Return the measurements so far."""
        return StatureState(self.factor, tuple(self._sizes), self._until)

    def restore(self, state: StatureState) -> None:
        """Go back to a snapshot."""
        self.factor, self._sizes, self._until = state.factor, list(state.sizes), state.until

    def watch(self, positions: Array, filled: Bools, time: float) -> None:
        """Measure positions (J, 3) [m] for the first second; joints `filled` (J,) are guesses."""
        if time > self._until:
            return
        size = _size(positions, filled, self._far, self._near, self._rest)
        if math.isnan(size):
            return
        if math.isnan(self._until):
            self._until = time + SECONDS
        self._sizes.append(size)
        size = statistics.median(self._sizes)
        self.factor = 1.0
        if abs(size - 1.0) > SAME:
            self.factor = 1.0 / min(max(size, 1.0 / MOST), MOST)


@kernel
def _size(positions: Array, filled: Bools, far: Indices, near: Indices, rest: Array) -> float:
    """The median length of the bones seen, as a multiple of rest; NaN if no bone was seen."""
    ratios = np.empty(len(rest))
    seen = 0
    for bone, length in enumerate(rest):
        if not (filled[far[bone]] or filled[near[bone]]):
            ratios[seen] = distance(positions[far[bone]], positions[near[bone]]) / length
            seen += 1
    return median(ratios[:seen]) if seen > 0 else np.nan
