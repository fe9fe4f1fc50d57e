"""Separate several senders on one port: each has its own decoder and performer numbers."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from devices.skeleton import Skeleton, SkeletonFrame

MOST_SENDERS = 8
PERFORMERS_A_SENDER = 100
SILENT = 0.5  # [s] after which a sender's slot goes to another sender of the same machine
FORGOTTEN = 10.0  # [s] after which it goes to any sender
MOST_KNOWN = 256


class Decoder(Protocol):
    """Converts one sender's messages to frames: no sockets, no clock, no exception on any bytes."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of every frame; always the same."""
        ...

    @property
    def refused(self) -> int:
        """Messages, or parts of them, that could not be decoded."""
        ...

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frames that a message, received at `arrival` [s], completes."""
        ...


@dataclass(slots=True)
class _Slot:
    """A sender's slot: its holder, when it was last heard [s], how many messages it sent."""

    source: Hashable
    decoder: Decoder
    heard: float
    messages: int = 0


def _machine(source: Hashable) -> Hashable:
    return source[0] if isinstance(source, tuple) and source else source


class Senders:
    """Passes each sender's messages to its own decoder, and gives performers distinct numbers.

    A sender is an address and a port. A restarted sender has another port: it takes the slot, and
    so the performers, of a silent sender on the same machine. If every packet comes from a new
    port, as with some scripts, the packets count as one sender.

    Args:
        make_decoder: makes the decoder of a new sender.

    Attributes:
        skeleton: of all frames.
        crowded_out: messages of senders beyond the first `MOST_SENDERS`.
    """

    def __init__(self, make_decoder: Callable[[], Decoder]) -> None:
        self.crowded_out = 0
        self._make_decoder = make_decoder
        first = make_decoder()
        self.skeleton = first.skeleton
        self._slots: list[_Slot] = [_Slot(None, first, -1e300)]
        self._known: OrderedDict[Hashable, None] = OrderedDict()

    @property
    def decoders(self) -> list[Decoder]:
        """The decoder of each sender so far."""
        return [slot.decoder for slot in self._slots]

    @property
    def refused(self) -> int:
        """Messages, or parts of them, that could not be decoded, or came from surplus senders."""
        return self.crowded_out + sum(decoder.refused for decoder in self.decoders)

    def feed(self, data: bytes, arrival: float, source: Hashable = "") -> Sequence[SkeletonFrame]:
        """Return the frames that a message of `source` completes."""
        number = self._number(source, arrival)
        self._remember(source)
        if number is None:
            self.crowded_out += 1
            return ()
        slot = self._slots[number]
        slot.heard = arrival
        slot.messages += 1
        frames = slot.decoder.feed(data, arrival)
        if number == 0:
            return frames
        base = number * PERFORMERS_A_SENDER
        return [replace(frame, performer=base + frame.performer) for frame in frames]

    def _number(self, source: Hashable, arrival: float) -> int | None:
        for number, slot in enumerate(self._slots):
            if slot.source == source:
                return number
        for number, slot in enumerate(self._slots):
            if self._free(slot, source, arrival):
                slot.source, slot.messages = source, 0
                return number
        if len(self._slots) == MOST_SENDERS:
            return None
        self._slots.append(_Slot(source, self._make_decoder(), arrival))
        return len(self._slots) - 1

    def _free(self, slot: _Slot, source: Hashable, arrival: float) -> bool:
        """Whether a sender without a slot may take this one."""
        silence = arrival - slot.heard
        if silence > FORGOTTEN:
            return True
        if _machine(slot.source) != _machine(source):
            return False
        # Two senders of one machine are each heard again from the same port. A new port continues
        # the last one only if no port is ever heard twice.
        return silence > SILENT or (slot.messages == 1 and source not in self._known)

    def _remember(self, source: Hashable) -> None:
        self._known[source] = None
        self._known.move_to_end(source)
        if len(self._known) > MOST_KNOWN:
            self._known.popitem(last=False)
