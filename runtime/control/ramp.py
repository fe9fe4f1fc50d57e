"""A level that goes smoothly to where it is told, from wherever it is."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


class Ramp:
    """A level in [0, 1], at 0 until told otherwise.

    Args:
        seconds: how long it takes to get where it goes.
        clock: host monotonic time [s].

    Attributes:
        target: where it is, or is going.
    """

    def __init__(self, seconds: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self.target = 0.0
        self._seconds = seconds
        self._clock = clock
        self._from = 0.0
        self._since = -math.inf

    @property
    def level(self) -> float:
        """Where it is now; it starts and arrives softly."""
        share = (self._clock() - self._since) / self._seconds
        if share >= 1.0:
            return self.target
        share = max(share, 0.0)
        level = self._from + (self.target - self._from) * share * share * (3.0 - 2.0 * share)
        return min(max(level, 0.0), 1.0)  # whatever rounding makes of its ends

    def to(self, target: float) -> None:
        """Go to `target` from now on."""
        self._from, self.target, self._since = self.level, target, self._clock()
