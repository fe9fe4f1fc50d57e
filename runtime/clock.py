"""Keeping time: the loop's ticks in real time, and the share of a tick that each stage takes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Ticker:
    """Holds a loop to a steady rate without drifting; a late tick is not made up for."""

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._next = time.monotonic()

    def wait(self) -> None:
        """Sleep until the next tick is due."""
        now = time.monotonic()
        if self._next > now:
            time.sleep(self._next - now)
        self._next = max(self._next, now) + self._period


class StageTimer:
    """How long the stages of the current tick have taken; a stage may run more than once.

    Attributes:
        stages: name of each stage to its time in this tick [s].
    """

    def __init__(self) -> None:
        self.stages: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time inside the block as the stage `name`."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - begin
            self.stages[name] = self.stages.get(name, 0.0) + spent

    def reset(self) -> None:
        """Begin a new tick."""
        self.stages = {}
