"""How long each stage of a tick takes, over a whole show."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import numpy as np

STAGES = ("poll", "match", "retarget", "deform", "render", "publish", "frame")


class StageTimes:
    """Every sample of every stage, as 4 bytes each: an hour at 60 Hz takes 5 MB.

    The stages are those of the report: ``poll``, ``match``, ``retarget``, ``deform``, ``render``,
    ``publish`` for the outputs, and ``frame`` for all of a tick.
    """

    def __init__(self) -> None:
        self._milliseconds = {stage: array("f") for stage in STAGES}

    def add(self, stage: str, seconds: float) -> None:
        """Note that `stage` took `seconds` [s] once."""
        self._milliseconds[stage].append(1e3 * seconds)

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Note how long the block takes; a block that raises does not count."""
        start = perf_counter()
        yield
        self.add(stage, perf_counter() - start)

    def summary(self) -> dict[str, dict[str, float]]:
        """For each stage its p50, p99 and max [ms]; zeros for a stage that never ran."""
        table = {}
        for stage, samples in self._milliseconds.items():
            taken = np.array(samples) if samples else np.zeros(1)
            p50, p99 = np.percentile(taken, (50, 99))
            table[stage] = {"p50": float(p50), "p99": float(p99), "max": float(taken.max())}
        return table
