"""Open Sound Control 1.0: read messages and bundles strictly and within bounds, and write them.

Source: the OSC 1.0 specification (Wright 2002), and the type tags that its 1.1 successor requires.
python-osc is not used to read: a bundle element of negative size hangs it, a future time tag makes
it sleep, and it fills in missing arguments.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

Argument = int | float | str | bytes | bool | None

BUNDLE = b"#bundle\0"
DEEPEST = 8  # nested bundles
MOST_ARGUMENTS = 4096
_LONGEST_TAGS = 64  # characters of type tags up to which a plan is cached
_NUMBERS = {"i": "i", "f": "f", "h": "q", "t": "Q", "d": "d"}
_ANY_NUMBER = "fdih"
_CONSTANTS: dict[str, Argument] = {"T": True, "F": False, "N": None, "I": float("inf")}


class OscError(ValueError):
    """The bytes are not an OSC packet."""


@dataclass(frozen=True, slots=True)
class Message:
    """One OSC message.

    Attributes:
        address: such as ``/VMC/Ext/Bone/Pos``.
        tags: the type tags without the comma, one for each argument.
        arguments: int for i, h and t (NTP, never waited for); float for f and d (may be NaN); str
            for s; bytes for b; True, False, None and infinity for T, F, N and I.
    """

    address: str
    tags: str
    arguments: tuple[Argument, ...]

    def begins(self, tags: str) -> bool:
        """Whether the arguments begin with these types; any number is an f or an i.

        python-osc sends whole numbers as ints, other senders all numbers as doubles.
        """
        if self.tags.startswith(tags):
            return True
        return len(self.tags) >= len(tags) and all(
            own == wanted or (wanted in _ANY_NUMBER and own in _ANY_NUMBER)
            for own, wanted in zip(self.tags, tags, strict=False)
        )


def read_packet(data: bytes) -> list[Message]:
    """Return the messages of one datagram, in order; bundles are opened, time tags ignored.

    Raises:
        OscError: anything in the datagram is malformed; all of it is refused then.
    """
    return [read_message(data, start, end) for start, end in elements(data)]


def elements(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield the begin and end of each message of a datagram, in order; bundles are opened.

    Raises:
        OscError: a bundle is malformed; the messages themselves are not checked.
    """
    return _elements(data, 0, len(data), 0)


def _elements(data: bytes, start: int, end: int, depth: int) -> Iterator[tuple[int, int]]:
    if (end - start) % 4 or end - start < 8:
        raise OscError(f"an element has {end - start} bytes")
    if not data.startswith(BUNDLE, start, end):
        yield start, end
        return
    if depth == DEEPEST:
        raise OscError(f"bundles lie more than {DEEPEST} deep")
    if end - start < 16:
        raise OscError("a bundle has no time tag")
    place = start + 16
    while place < end:
        (size,) = struct.unpack_from(">i", data, place)
        place += 4
        if not 8 <= size <= end - place:
            raise OscError(f"an element claims {size} of {end - place} bytes")
        yield from _elements(data, place, place + size, depth + 1)
        place += size


def read_message(data: bytes, start: int, end: int) -> Message:
    """Return the message between two offsets of a datagram.

    Raises:
        OscError: it is malformed.
    """
    address, place = _text(data, start, end)
    if not address or address[0] in "#,":
        raise OscError("a message has no address")
    if data[place : place + 1] != b"," or place >= end:
        raise OscError(f"{address[:40]!r} has no type tags")
    tags, place = _text(data, place, end)
    if len(tags) - 1 > MOST_ARGUMENTS:
        raise OscError(f"{address[:40]!r} has {len(tags) - 1} arguments")
    arguments: list[Argument] = []
    for kind, reader in _plan(tags[1:]) if len(tags) <= _LONGEST_TAGS else _steps(tags[1:]):
        if reader is not None:
            if reader.size > end - place:
                raise OscError(f"{address[:40]!r} ends within its arguments")
            arguments += reader.unpack_from(data, place)
            place += reader.size
        elif kind == "s":
            text, place = _text(data, place, end)
            arguments.append(text)
        elif kind == "b":
            blob, place = _blob(data, place, end)
            arguments.append(blob)
        else:
            arguments.append(_CONSTANTS[kind])
    if place != end:
        raise OscError(f"{address[:40]!r} has {end - place} bytes more than its type tags say")
    return Message(address, tags[1:], tuple(arguments))


def numbers_at_end(tags: str) -> int:
    """Return the number of bytes of numbers at the end of a message with these type tags."""
    numbers = tags[len(tags.rstrip("".join(_NUMBERS))) :]
    return struct.calcsize(">" + "".join(_NUMBERS[tag] for tag in numbers))


def _steps(tags: str) -> tuple[tuple[str, struct.Struct | None], ...]:
    """How to read arguments: runs of numbers at once, every other argument separately."""
    steps: list[tuple[str, struct.Struct | None]] = []
    run = ""
    for tag in tags:
        if tag in _NUMBERS:
            run += _NUMBERS[tag]
            continue
        if tag not in "sb" and tag not in _CONSTANTS:
            raise OscError(f"the type tag {tag!r} is unknown")
        if run:
            steps.append(("", struct.Struct(">" + run)))
            run = ""
        steps.append((tag, None))
    if run:
        steps.append(("", struct.Struct(">" + run)))
    return tuple(steps)


_plan = lru_cache(maxsize=256)(_steps)


def _text(data: bytes, start: int, end: int) -> tuple[str, int]:
    """The string at `start`, and the offset after its padding."""
    stop = data.find(b"\0", start, end)
    if stop < 0:
        raise OscError("a string does not end")
    after = start + (stop - start) // 4 * 4 + 4
    if after > end:
        raise OscError("a string is not padded")
    try:
        return data[start:stop].decode("utf-8"), after
    except UnicodeDecodeError:
        raise OscError("a string is not UTF-8") from None


def _blob(data: bytes, start: int, end: int) -> tuple[bytes, int]:
    """The blob at `start`, and the offset after its padding."""
    if end - start < 4:
        raise OscError("a blob has no size")
    (size,) = struct.unpack_from(">i", data, start)
    after = start + 4 + (size + 3) // 4 * 4
    if size < 0 or after > end:
        raise OscError(f"a blob claims {size} of {end - start - 4} bytes")
    return data[start + 4 : start + 4 + size], after


def write_message(address: str, tags: str = "", *arguments: float | str) -> bytes:
    """Return one message with arguments according to its type tags (of i, f, s, h, d).

    Raises:
        OscError: another type tag.
    """
    data = [_padded(address), _padded("," + tags)]
    for tag, argument in zip(tags, arguments, strict=True):
        if tag == "s":
            data.append(_padded(str(argument)))
        elif tag in _NUMBERS:
            data.append(struct.pack(">" + _NUMBERS[tag], argument))
        else:
            raise OscError(f"the type tag {tag!r} cannot be written")
    return b"".join(data)


def write_bundles(messages: Iterable[bytes], longest: int) -> Iterator[bytes]:
    """Yield the messages in order in as few bundles of at most `longest` bytes as possible.

    A longer message gets a bundle of its own.
    """
    head = BUNDLE + struct.pack(">Q", 1)  # time tag: at once
    bundle = [head]
    size = len(head)
    for message in messages:
        if len(bundle) > 1 and size + 4 + len(message) > longest:
            yield b"".join(bundle)
            bundle, size = [head], len(head)
        bundle += (struct.pack(">i", len(message)), message)
        size += 4 + len(message)
    if len(bundle) > 1:
        yield b"".join(bundle)


def _padded(text: str) -> bytes:
    data = text.encode("utf-8")
    return data + bytes(4 - len(data) % 4)
