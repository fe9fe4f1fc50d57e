"""Keeping time: the loop's ticks in real time, and the share of a tick that each stage takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Ticker:
    """Holds a loop to a steady rate without drifting; a late tick is not made up for.

    Args:
        rate: ticks a second.
        clock: host monotonic time [s].
        sleep: waits for so many seconds.
    """

    def __init__(
        self,
        rate: float,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period = 1.0 / rate
        self._clock = clock
        self._sleep = sleep
        self._next = clock()

    def wait(self) -> None:
        """Sleep until the next tick is due."""
        now = self._clock()
        if self._next > now:
            self._sleep(self._next - now)
        self._next = max(self._next, now) + self._period


class StageTimer:
    """How long the stages of the current tick have taken; a stage may run more than once.

    Args:
        clock: any clock [s] of high resolution.

    Attributes:
        stages: name of each stage to its time in this tick [s].
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self.stages: dict[str, float] = {}
        self._clock = clock

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time inside the block as the stage `name`."""
        begin = self._clock()
        try:
            yield
        finally:
            spent = self._clock() - begin
            self.stages[name] = self.stages.get(name, 0.0) + spent

    def reset(self) -> None:
        """Begin a new tick."""
        self.stages = {}
