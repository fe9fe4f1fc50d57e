"""Statistics of the duration of each stage of a tick, over a whole show."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import numpy as np

STAGES = ("poll", "match", "retarget", "deform", "render", "publish", "frame", "settle", "latency")

_FIRST = 1e-4  # [ms] shorter durations count as this
_BINS_A_FOLD = 200  # for every factor of e: a bin is half a percent wide
_BINS = 4600  # up to 10^10 times the first


class StageTimes:
    """Counts every sample of every stage, in memory that does not grow.

    Keeps a histogram with bins half a percent wide, and the exact maximum. The stages are those of
    the report: ``poll``, ``match``, ``retarget``, ``deform``, ``render``, ``publish`` for the
    outputs, ``frame`` for the whole tick, ``settle`` for the work after it, and ``latency`` from
    the arrival of a frame until it is handed to the display, where the arrival is known.
    """

    def __init__(self) -> None:
        self._counts = {stage: np.zeros(_BINS, np.int64) for stage in STAGES}
        self._longest = dict.fromkeys(STAGES, 0.0)

    def add(self, stage: str, seconds: float) -> None:
        """Add one sample of `seconds` [s] for `stage`."""
        milliseconds = 1e3 * seconds
        place = int(_BINS_A_FOLD * math.log(max(milliseconds / _FIRST, 1.0)))
        self._counts[stage][min(place, _BINS - 1)] += 1
        self._longest[stage] = max(self._longest[stage], milliseconds)

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Measure this block as one sample; a block that raises does not count."""
        start = perf_counter()
        yield
        self.add(stage, perf_counter() - start)

    def summary(self) -> dict[str, dict[str, float]]:
        """Return p50, p99 and max [ms] of each stage; zeros for a stage that never ran."""
        return {
            stage: {
                "p50": self._quantile(stage, 0.50),
                "p99": self._quantile(stage, 0.99),
                "max": self._longest[stage],
            }
            for stage in STAGES
        }

    def _quantile(self, stage: str, share: float) -> float:
        """Return the quantile at `share` [ms]: the middle of its bin."""
        counts = np.cumsum(self._counts[stage])
        if counts[-1] == 0:
            return 0.0
        place = int(np.searchsorted(counts, share * counts[-1]))
        middle = _FIRST * math.exp((place + 0.5) / _BINS_A_FOLD)
        return min(middle, self._longest[stage])
