"""Rotations as they were some time ago, so that like limbs can move one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

MOST = 4.0  # [s] that is remembered


@dataclass(frozen=True, slots=True, eq=False)
class DelayLineState:
    """The memory of a `DelayLine`: the times [s] and the rotations (B, 4) at them, oldest first."""

    times: tuple[float, ...]
    rotations: tuple[Array, ...]


class DelayLine:
    """Delays each of B rotations by a time of its own.

    Between two frames it turns evenly from one rotation to the next. Of a time before the first
    frame it gives the first.

    Args:
        delays: (B,) [s] from 0 to `MOST`.

    Attributes:
        delays: may be set while it runs; what is remembered stays.
    """

    def __init__(self, delays: ArrayLike) -> None:
        self.delays = np.asarray(delays, dtype=np.float64)
        self._times: tuple[float, ...] = ()
        self._rotations: tuple[Array, ...] = ()

    def follow(self, time: float, rotations: Array) -> Array:
        """Take in rotations (B, 4) at a time [s]; return the delayed ones (B, 4).

        A time before the last begins anew, as after a jump; one that is not finite is no moment of
        the motion, and passes.
        """
        if not np.isfinite(time):
            return rotations
        if self._times and time < self._times[-1]:
            self.reset()
        if self._times and time == self._times[-1]:
            self._times, self._rotations = self._times[:-1], self._rotations[:-1]
        first = 0
        while first + 1 < len(self._times) and self._times[first + 1] <= time - MOST:
            first += 1
        self._times = (*self._times[first:], time)
        self._rotations = (*self._rotations[first:], rotations.copy())
        if not self.delays.any():
            return rotations
        delayed = rotations.copy()
        for delay in np.unique(self.delays[self.delays > 0.0]).tolist():
            rows = self.delays == delay
            delayed[rows] = self._at(time - delay, rows)
        return delayed

    def _at(self, time: float, rows: NDArray[np.bool_]) -> Array:
        after = int(np.searchsorted(self._times, time))
        if after == 0:
            first: Array = self._rotations[0][rows]
            return first
        before = after - 1
        share = (time - self._times[before]) / (self._times[after] - self._times[before])
        start, end = self._rotations[before][rows], self._rotations[after][rows]
        side = np.where(np.einsum("bi,bi->b", start, end) < 0.0, -1.0, 1.0)[:, None]
        between = (1.0 - share) * start + share * side * end
        unit: Array = between / np.linalg.norm(between, axis=1, keepdims=True)
        return unit

    def reset(self) -> None:
        """Forget what was, as after a cut."""
        self._times, self._rotations = (), ()

    def snapshot(self) -> DelayLineState:
        """Return the memory; nobody writes to its arrays."""
        return DelayLineState(self._times, self._rotations)

    def restore(self, state: DelayLineState) -> None:
        """Go back to a snapshot."""
        self._times, self._rotations = state.times, state.rotations
