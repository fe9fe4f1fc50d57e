"""Messages from the tracker's process to the show, through a pipe.

A message is its kind (one byte), the number of its bytes (u32, little-endian), and the bytes.
"""

from __future__ import annotations

import struct
from typing import IO, BinaryIO

READY = b"R"  # the camera or film is open
LANDMARKS = b"L"  # JSON, as `devices.mediapipe.landmark_messages` reads it
TROUBLE = b"T"  # one line that says why nothing comes now; an empty one takes it back
FAILED = b"F"  # one line that says why the tracker ends
OVER = b"O"  # the film is over

BEGIN = b"b"
"""What the show sends, once it wants the first picture of a film."""

MOST_BYTES = 1 << 20
_HEADER = struct.Struct("<cI")


def write_message(pipe: BinaryIO, kind: bytes, data: bytes = b"") -> None:
    """Write a message at once.

    Raises:
        OSError: the show has ended.
    """
    pipe.write(_HEADER.pack(kind, len(data)) + data)
    pipe.flush()


def read_message(pipe: IO[bytes]) -> tuple[bytes, bytes] | None:
    """Return the kind and the bytes of the next message; None once the tracker has ended."""
    head = pipe.read(_HEADER.size)
    if len(head) < _HEADER.size:
        return None
    kind, size = _HEADER.unpack(head)
    if size > MOST_BYTES:
        return None
    data = pipe.read(size)
    return (kind, data) if len(data) == size else None
