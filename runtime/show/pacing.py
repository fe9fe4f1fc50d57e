"""The pace of a show: when the next tick begins, and what the time before it is used for."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from devices.stream import SkeletonStream
from runtime.show.clock import Ticker

TICKS = 60.0  # a second, where no frame sets the pace
LULL = 0.04  # [s] without a frame before a tick without one; longer than a camera's step
MOST_TICKS = 240.0  # a second; frames that come faster, of several performers, share a tick


class Pace(Protocol):
    """Waits between ticks."""

    def wait(self) -> None:
        """Return when the next tick is due."""
        ...

    def is_due(self) -> bool:
        """Whether the next tick is due already."""
        ...


@runtime_checkable
class Waking(Protocol):
    """A stream that can be waited for."""

    def wait(self, seconds: float) -> bool:
        """Sleep until a frame is there, at most `seconds` [s]; return whether one is."""
        ...


class OnArrival:
    """Starts a tick as soon as a frame is there, at most `MOST_TICKS` a second.

    When no frame has come for `LULL` seconds, ticks without a frame start, `TICKS` a second, so
    that the window stays alive. They do not start earlier, because such a tick would delay a frame
    that arrives during it.

    Args:
        stream: gives the frames.
        clock: host monotonic time [s].
        sleep: sleeps for a number of seconds.
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
    """Starts each tick right after the one before."""

    def wait(self) -> None:
        """Return at once."""

    def is_due(self) -> bool:
        """Return False: the next tick waits for this one."""
        return False


class Settling(Protocol):
    """Surfaces on which the solver can iterate between ticks, as those of a `FrameLoop`."""

    def settle(self) -> None:
        """Run the iterations that are left."""
        ...

    def hurry(self) -> None:
        """Skip the iterations that are left."""
        ...


class SpareTime:
    """Settles the surfaces in the time that is left after a tick has been shown.

    When the next tick is due already, the surfaces skip it, so that a late tick does not become
    later. They never skip it twice in a row: a show that is always late settles them after every
    other tick.

    Args:
        pace: says whether the next tick is due.
        surfaces: the surfaces that settle.
    """

    def __init__(self, pace: Pace, surfaces: Settling) -> None:
        self._pace = pace
        self._surfaces = surfaces
        self._has_settled = True

    def spend(self) -> None:
        """Settle the surfaces if there is time; call it once a tick."""
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
