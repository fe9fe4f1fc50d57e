"""A ticker that keeps a steady rate, and a timer of the stages of a tick."""

from __future__ import annotations

import time
from collections.abc import Callable


class Ticker:
    """Keeps a loop at a steady rate without drift; a late tick is not caught up.

    Args:
        rate: ticks a second.
        clock: host monotonic time [s].
        sleep: sleeps for a number of seconds.
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

    def is_due(self) -> bool:
        """Whether the next tick is due already."""
        return self._clock() >= self._next


class StageTimer:
    """Adds up the time of each stage of the current tick; a stage may run more than once.

    Args:
        clock: any clock [s] of high resolution.

    Attributes:
        stages: name of each stage to its time in this tick [s].
        clock: the clock above.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self.stages: dict[str, float] = {}
        self.clock = clock

    def stage(self, name: str) -> _Stage:
        """Count the time inside a `with` block as the stage `name`."""
        return _Stage(self, name)

    def add(self, name: str, spent: float) -> None:
        """Add time [s] to the stage `name`."""
        self.stages[name] = self.stages.get(name, 0.0) + spent

    def reset(self) -> None:
        """Start a new tick."""
        self.stages = {}


class _Stage:
    """The block of one stage; a class, because a generator would take three times as long."""

    __slots__ = ("_began", "_name", "_timer")

    def __init__(self, timer: StageTimer, name: str) -> None:
        self._timer = timer
        self._name = name
        self._began = 0.0

    def __enter__(self) -> None:
        self._began = self._timer.clock()

    def __exit__(self, *exc: object) -> None:
        self._timer.add(self._name, self._timer.clock() - self._began)
