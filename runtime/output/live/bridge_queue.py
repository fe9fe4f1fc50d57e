"""What one stage of a bridge is still owed: the newest frame of each performer, or every frame.

Both keep to the stage's credit: as many frames are under way at once as it has room for, and what
it has not told of having received counts as under way. So a slow network or a stage that stands
still holds back what is sent instead of filling queues with what is past.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Protocol

PERFORMERS = 256
BYTES = 64 << 20
"""What is kept of every frame: nine minutes of one body of 32 joints with rotations at 60 Hz."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """A frame as it goes out; its bytes are shared by all stages."""

    sequence: int
    performer: int
    data: bytes


class BridgeQueue(Protocol):
    """The order in which frames go to one stage.

    Attributes:
        sent: the highest sequence number that went out, or that the stage is not owed.
        dropped: frames that the stage was owed and will not get.
    """

    sent: int
    dropped: int

    def offer(self, parcel: Parcel) -> None:
        """Take in the newest frame."""
        ...

    def received(self, sequence: int) -> None:
        """Note that everything up to `sequence` has arrived."""
        ...

    def reconnect(self, sequence: int) -> None:
        """Note that what was under way is gone, after `sequence` has arrived."""
        ...

    def draw(self, credit: int) -> Parcel | None:
        """The next frame to send, if there is one and fewer than `credit` are under way."""
        ...

    @property
    def empty(self) -> bool:
        """Whether the stage has all that must not be lost."""
        ...


class LatestQueue:
    """The newest frame of each performer; one that is overtaken before it goes out is left out."""

    empty = True

    def __init__(self, sent: int) -> None:
        self.sent = sent
        self.dropped = 0
        self._waiting: dict[int, Parcel] = {}  # of each performer, oldest first
        self._flying: deque[int] = deque()

    def offer(self, parcel: Parcel) -> None:
        """Take in the newest frame; that of the same performer which waits is dropped."""
        self.dropped += self._waiting.pop(parcel.performer, None) is not None
        if len(self._waiting) >= PERFORMERS:
            self._waiting.pop(next(iter(self._waiting)))
            self.dropped += 1
        self._waiting[parcel.performer] = parcel

    def received(self, sequence: int) -> None:
        """Note that everything up to `sequence` has arrived."""
        while self._flying and self._flying[0] <= sequence:
            self._flying.popleft()

    def reconnect(self, sequence: int) -> None:
        """Forget what was under way: newer frames are better."""
        del sequence
        self._flying.clear()

    def draw(self, credit: int) -> Parcel | None:
        """The oldest of the newest frames, so that sequence numbers rise."""
        if not self._waiting or len(self._flying) >= credit:
            return None
        parcel = self._waiting.pop(next(iter(self._waiting)))
        self._flying.append(parcel.sequence)
        self.sent = parcel.sequence
        return parcel


class LosslessQueue:
    """Every frame in order, kept until it arrived; beyond `limit` bytes the oldest are dropped."""

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
        """Take in the newest frame."""
        self._waiting.append(parcel)
        self._kept += len(parcel.data)
        while self._kept > self._limit and len(self._waiting) > 1:
            self._kept -= len(self._waiting.popleft().data)
            self.dropped += 1

    def received(self, sequence: int) -> None:
        """Let go of everything up to `sequence`."""
        while self._flying and self._flying[0].sequence <= sequence:
            self._kept -= len(self._flying.popleft().data)

    def reconnect(self, sequence: int) -> None:
        """Send again what was under way and has not arrived."""
        self.received(sequence)
        self._waiting.extendleft(reversed(self._flying))
        self._flying.clear()
        self.sent = min(self.sent, sequence)

    def draw(self, credit: int) -> Parcel | None:
        """The oldest frame that has not gone out."""
        if not self._waiting or len(self._flying) >= credit:
            return None
        parcel = self._waiting.popleft()
        self._flying.append(parcel)
        self.sent = parcel.sequence
        return parcel
