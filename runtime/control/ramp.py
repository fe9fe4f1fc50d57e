"""A value in [0, 1] that moves smoothly to a new target."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


class Ramp:
    """A value in [0, 1], 0 at first, that moves to each new target in a fixed time.

    A ramp belongs to the light, not to the performance: it runs on the host's clock, so it has no
    snapshot.

    Args:
        seconds: how long a move takes.
        clock: host monotonic time [s].

    Attributes:
        target: the value at the end of the move.
    """

    def __init__(self, seconds: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self.target = 0.0
        self._seconds = seconds
        self._clock = clock
        self._from = 0.0
        self._since = -math.inf

    @property
    def level(self) -> float:
        """The value now; a move starts and ends softly, by 3s^2 - 2s^3 of its time."""
        share = (self._clock() - self._since) / self._seconds
        if share >= 1.0:
            return self.target
        share = max(share, 0.0)
        level = self._from + (self.target - self._from) * share * share * (3.0 - 2.0 * share)
        return min(max(level, 0.0), 1.0)  # rounding may leave the range

    def to(self, target: float) -> None:
        """Move to `target`, from the value that it has now."""
        self._from, self.target, self._since = self.level, target, self._clock()
