"""Watches a stream: whether a performer is awaited, seen, lost or not understood."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol, runtime_checkable

from devices.stream import SkeletonStream
from devices.transport.traffic import Traffic

LOST = 1.0  # [s] without a frame until a performer counts as lost
PATIENCE = 5.0  # [s] with packets and no frame until it is told: a sender may begin with a greeting


class Sight(Enum):
    """What is seen of the performer."""

    WAITING = "waiting"  # nothing has come yet
    NOT_UNDERSTOOD = "not understood"  # packets come, and no frame in them
    SEEN = "seen"
    LOST = "lost"  # frames came, and come no more
    ENDED = "ended"


@dataclass(frozen=True, slots=True)
class Sighting:
    """What is seen of the performer at one moment.

    Attributes:
        sight: see `Sight`.
        seconds: [s] since it is so.
        packets: messages that came, valid or not; 0 for a recording.
        refused: those that could not be decoded.
        trouble: one line that describes a fault of the connection; empty if there is none.
    """

    sight: Sight
    seconds: float
    packets: int = 0
    refused: int = 0
    trouble: str = ""


@runtime_checkable
class CountedStream(Protocol):
    """A live stream that counts what comes."""

    @property
    def traffic(self) -> Traffic:
        """What came so far."""
        ...


class StreamWatch:
    """Notes when frames come, and tells what is seen.

    Args:
        stream: the source itself, not wrapped.
        live: whether silence means that the performer is lost; a recording may pause.
        clock: host monotonic time [s].
    """

    def __init__(
        self,
        stream: SkeletonStream,
        *,
        live: bool,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._stream, self._live, self._clock = stream, live, clock
        self._newest = math.nan
        self._sight = Sight.WAITING
        self._told = Sight.WAITING
        self._since = clock()

    def note(self) -> None:
        """Note that a frame has come."""
        self._newest = self._clock()

    @property
    def silence(self) -> float:
        """[s] since the newest frame; 0 before the first, and for a recording."""
        if not self._live or math.isnan(self._newest):
            return 0.0
        return max(self._clock() - self._newest, 0.0)

    def look(self) -> Sighting:
        """Return what is seen now."""
        traffic = self._stream.traffic if isinstance(self._stream, CountedStream) else Traffic()
        now = self._clock()
        sight = self._sight_now(traffic)
        if sight is not self._sight:
            lost = sight is Sight.LOST
            self._sight, self._since = sight, self._newest if lost else now
        return Sighting(sight, now - self._since, traffic.packets, traffic.refused, traffic.trouble)

    def changed(self) -> tuple[Sight, Sighting] | None:
        """Return what was seen before and what is seen now, once after each change; else None.

        What is not understood is told only if it has been so for `PATIENCE`.
        """
        before, sighting = self._told, self.look()
        if sighting.sight is before:
            return None
        if sighting.sight is Sight.NOT_UNDERSTOOD and sighting.seconds < PATIENCE:
            return None
        self._told = sighting.sight
        return before, sighting

    def _sight_now(self, traffic: Traffic) -> Sight:
        if self._stream.ended:
            return Sight.ENDED
        if math.isnan(self._newest):
            return Sight.NOT_UNDERSTOOD if traffic.packets else Sight.WAITING
        return Sight.LOST if self.silence > LOST else Sight.SEEN
