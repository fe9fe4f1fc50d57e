"""When the loop's next tick comes: at a steady rate, or as soon as there is a frame to perform."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from devices.stream import SkeletonStream
from runtime.show.clock import Ticker

TICKS = 60.0  # a second, where nothing else sets the pace
LULL = 0.04  # [s] without a frame, more than between those of a camera; only then tick without one
MOST_TICKS = 240.0  # a second; what comes faster, from several performers, is taken together


class Pace(Protocol):
    """Waits between ticks."""

    def wait(self) -> None:
        """Return when the next tick should begin."""
        ...

    def is_due(self) -> bool:
        """Whether the next tick should have begun already."""
        ...


@runtime_checkable
class Waking(Protocol):
    """A stream that can be waited for."""

    def wait(self, seconds: float) -> bool:
        """Sleep until a frame is there, at most so long; whether one is."""
        ...


class OnArrival:
    """A tick as soon as a frame is there, so that none waits for a tick, at most `MOST_TICKS` a
    second; once none has come for `LULL` seconds also without one, `TICKS` a second, for whoever
    looks. A tick without a frame just before one comes would only hold it up.

    Args:
        stream: whose frames they are.
        clock: host monotonic time [s].
        sleep: waits for so many seconds.
    """

    def __init__(
        self,
        stream: Waking,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._stream = stream
        self._clock = clock
        self._sleep = sleep
        self._began = clock()
        self._flowing = False

    def wait(self) -> None:
        """Sleep until a frame is there or the next tick is due without one."""
        early = self._began + 1.0 / MOST_TICKS - self._clock()
        if early > 0.0:
            self._sleep(early)
        patience = LULL if self._flowing else 1.0 / TICKS
        self._flowing = self._stream.wait(max(self._began + patience - self._clock(), 0.0))
        self._began = self._clock()

    def is_due(self) -> bool:
        """Whether a frame is there already."""
        return self._stream.wait(0.0)


class AtOnce:
    """One tick right after the other, and each has all the time that it takes."""

    def wait(self) -> None:
        """Return at once."""

    def is_due(self) -> bool:
        """Never: nobody waits for the next tick."""
        return False


class Settling(Protocol):
    """Surfaces that come nearer to rest between ticks, as those of a `FrameLoop`."""

    def settle(self) -> None:
        """Bring them nearer to rest."""
        ...

    def hurry(self) -> None:
        """Leave them as they were shown."""
        ...


class SpareTime:
    """What is left of a tick's time once it has been shown: the surfaces settle in it.

    Where the next tick is due already they do not: a tick that a busy machine held up is not made
    longer still. They are never left out twice running, so that a show that is always late settles
    them after every other tick.

    Args:
        pace: knows when the next tick is due.
        surfaces: what settles.
    """

    def __init__(self, pace: Pace, surfaces: Settling) -> None:
        self._pace = pace
        self._surfaces = surfaces
        self._has_settled = True

    def spend(self) -> None:
        """Settle the surfaces if there is time; to be called once a tick."""
        self._has_settled = not self._has_settled or not self._pace.is_due()
        if self._has_settled:
            self._surfaces.settle()
        else:
            self._surfaces.hurry()


@runtime_checkable
class FrameByFrame(Protocol):
    """A stream that may give exactly one frame a poll and lets its frames wait for the loop."""

    @property
    def every_frame(self) -> bool:
        """Whether it does so now."""
        ...


def loses_no_frame(stream: SkeletonStream) -> bool:
    """Whether the frames of a stream wait for the loop, however long it takes."""
    return isinstance(stream, FrameByFrame) and stream.every_frame


def pace_of(stream: SkeletonStream) -> Pace:
    """The pace that suits a stream.

    One tick right after the other where its frames wait for the loop, on arrival where the loop can
    wait for its frames, else `TICKS` a second.
    """
    if loses_no_frame(stream):
        return AtOnce()
    return OnArrival(stream) if isinstance(stream, Waking) else Ticker(TICKS)
