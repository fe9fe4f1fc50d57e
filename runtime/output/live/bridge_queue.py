"""Send queues of a bridge: the newest frame of each performer, or every frame, per subscriber.

Both respect the subscriber's credit: the number of unacknowledged frames never exceeds the space
that the subscriber has. So a slow network or a stopped subscriber delays sending, and no queue
fills up with outdated frames.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Protocol

PERFORMERS = 256
BYTES = 64 << 20
"""Limit of a lossless queue: nine minutes of one body with 32 joints and rotations at 60 Hz."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """An encoded frame, and its face or nothing; all subscribers share the bytes."""

    sequence: int
    performer: int
    data: bytes
    face: bytes = b""

    @property
    def size(self) -> int:
        """Bytes of both."""
        return len(self.data) + len(self.face)


class BridgeQueue(Protocol):
    """The order in which frames are sent to one subscriber.

    Attributes:
        sent: the highest sequence number that was sent, or that the subscriber need not get.
        dropped: frames that the subscriber should have got and will not get.
    """

    sent: int
    dropped: int

    def offer(self, parcel: Parcel) -> None:
        """Add the newest frame."""
        ...

    def received(self, sequence: int) -> None:
        """Record that every frame up to `sequence` has arrived."""
        ...

    def reconnect(self, sequence: int) -> None:
        """Record that the unacknowledged frames after `sequence` are lost."""
        ...

    def draw(self, credit: int) -> Parcel | None:
        """Return the next frame to send, if fewer than `credit` frames are unacknowledged."""
        ...

    @property
    def empty(self) -> bool:
        """Whether the subscriber has every frame that must not be lost."""
        ...


class LatestQueue:
    """The newest frame of each performer; a newer frame replaces one that was not sent yet."""

    empty = True

    def __init__(self, sent: int) -> None:
        self.sent = sent
        self.dropped = 0
        self._waiting: dict[int, Parcel] = {}  # of each performer, oldest first
        self._flying: deque[int] = deque()

    def offer(self, parcel: Parcel) -> None:
        """Add the newest frame; drop a waiting frame of the same performer."""
        self.dropped += self._waiting.pop(parcel.performer, None) is not None
        if len(self._waiting) >= PERFORMERS:
            self._waiting.pop(next(iter(self._waiting)))
            self.dropped += 1
        self._waiting[parcel.performer] = parcel

    def received(self, sequence: int) -> None:
        """Record that every frame up to `sequence` has arrived."""
        while self._flying and self._flying[0] <= sequence:
            self._flying.popleft()

    def reconnect(self, sequence: int) -> None:
        """Forget the unacknowledged frames: newer frames replace them."""
        del sequence
        self._flying.clear()

    def draw(self, credit: int) -> Parcel | None:
        """Return the oldest waiting frame, so that sequence numbers increase."""
        if not self._waiting or len(self._flying) >= credit:
            return None
        parcel = self._waiting.pop(next(iter(self._waiting)))
        self._flying.append(parcel.sequence)
        self.sent = parcel.sequence
        return parcel


class LosslessQueue:
    """Every frame in order, kept until it arrived; above `limit` bytes the oldest are dropped."""

    def __init__(self, sent: int, limit: int = BYTES) -> None:
        self.sent = sent
        self.dropped = 0
        self._limit = limit
        self._kept = 0  # bytes
        self._waiting: deque[Parcel] = deque()
        self._flying: deque[Parcel] = deque()

    @property
    def empty(self) -> bool:
        """Whether everything has arrived."""
        return not (self._waiting or self._flying)

    def offer(self, parcel: Parcel) -> None:
        """Add the newest frame."""
        self._waiting.append(parcel)
        self._kept += parcel.size
        while self._kept > self._limit and len(self._waiting) > 1:
            self._kept -= self._waiting.popleft().size
            self.dropped += 1

    def received(self, sequence: int) -> None:
        """Release every frame up to `sequence`."""
        while self._flying and self._flying[0].sequence <= sequence:
            self._kept -= self._flying.popleft().size

    def reconnect(self, sequence: int) -> None:
        """Queue the unacknowledged frames again."""
        self.received(sequence)
        self._waiting.extendleft(reversed(self._flying))
        self._flying.clear()
        self.sent = min(self.sent, sequence)

    def draw(self, credit: int) -> Parcel | None:
        """Return the oldest frame that was not sent."""
        if not self._waiting or len(self._flying) >= credit:
            return None
        parcel = self._waiting.popleft()
        self._flying.append(parcel)
        self.sent = parcel.sequence
        return parcel
