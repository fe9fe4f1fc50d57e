"""Several senders on one port, told apart: each has a decoder and performers of its own."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from devices.skeleton import Skeleton, SkeletonFrame

MOST_SENDERS = 8
PERFORMERS_A_SENDER = 100
SILENT = 0.5  # [s] after which a sender's place goes to another of the same machine
FORGOTTEN = 10.0  # [s] after which it goes to anybody
MOST_KNOWN = 256


class Decoder(Protocol):
    """Turns one sender's messages into frames: no sockets, no clock, no exception on any bytes."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of every frame; always the same."""
        ...

    @property
    def refused(self) -> int:
        """Messages, or parts of them, that were not understood."""
        ...

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Take in one message that came at `arrival` [s]; the frames that it completes."""
        ...


@dataclass(slots=True)
class _Place:
    """One sender's place: who holds it, when it was last heard [s], how many messages it sent."""

    source: Hashable
    decoder: Decoder
    heard: float
    messages: int = 0


def _machine(source: Hashable) -> Hashable:
    return source[0] if isinstance(source, tuple) and source else source


class Senders:
    """Feeds each sender's messages to a decoder of its own, and numbers the performers apart.

    A sender is an address and a port. One that starts again comes from another port: it takes the
    place, and so the performers, of one of its machine that has gone silent. Where every packet
    comes from a new port, as some scripts send them, they are taken for one sender.

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
        self._places: list[_Place] = [_Place(None, first, -1e300)]
        self._known: OrderedDict[Hashable, None] = OrderedDict()

    @property
    def decoders(self) -> list[Decoder]:
        """The decoder of each sender so far."""
        return [place.decoder for place in self._places]

    @property
    def refused(self) -> int:
        """Messages, or parts of them, that were not understood, or came from one too many."""
        return self.crowded_out + sum(decoder.refused for decoder in self.decoders)

    def feed(self, data: bytes, arrival: float, source: Hashable = "") -> Sequence[SkeletonFrame]:
        """Take in one message of `source`; the frames that it completes."""
        number = self._number(source, arrival)
        self._know(source)
        if number is None:
            self.crowded_out += 1
            return ()
        place = self._places[number]
        place.heard = arrival
        place.messages += 1
        frames = place.decoder.feed(data, arrival)
        if number == 0:
            return frames
        base = number * PERFORMERS_A_SENDER
        return [replace(frame, performer=base + frame.performer) for frame in frames]

    def _number(self, source: Hashable, arrival: float) -> int | None:
        for number, place in enumerate(self._places):
            if place.source == source:
                return number
        for number, place in enumerate(self._places):
            if self._free(place, source, arrival):
                place.source, place.messages = source, 0
                return number
        if len(self._places) == MOST_SENDERS:
            return None
        self._places.append(_Place(source, self._make_decoder(), arrival))
        return len(self._places) - 1

    def _free(self, place: _Place, source: Hashable, arrival: float) -> bool:
        """Whether a sender that has no place may have this one."""
        silence = arrival - place.heard
        if silence > FORGOTTEN:
            return True
        if _machine(place.source) != _machine(source):
            return False
        # Two senders of one machine: each of them is heard again from the same port. Only where
        # nobody ever is does the next port go on where the last one stopped.
        return silence > SILENT or (place.messages == 1 and source not in self._known)

    def _know(self, source: Hashable) -> None:
        self._known[source] = None
        self._known.move_to_end(source)
        if len(self._known) > MOST_KNOWN:
            self._known.popitem(last=False)
