"""Reads MCAP records from bytes that may be cut or damaged; every size is bounded.

The library's own readers stop at the first fault (`StreamReader`) or read nothing without a summary
(`SeekingReader`), and trust every stated length. These functions yield intact records, and report
where and why they stop. Specification: https://mcap.dev/spec
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import IO

import lz4.frame  # type: ignore[import-untyped]  # lz4 has no types
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, Footer, Message, Metadata, Schema

MAGIC = b"\x89MCAP0\r\n"
MAX_RECORD = 64 << 20
FOOTER_BYTES = 1 + 8 + 20

Record = Channel | Chunk | ChunkIndex | Footer | Message | Metadata | Schema

_READERS: dict[int, Callable[[ReadDataStream], Record]] = {
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.CHUNK_INDEX: ChunkIndex.read,
    Opcode.FOOTER: Footer.read,
    Opcode.METADATA: Metadata.read,
    Opcode.SCHEMA: Schema.read,
}


class DamagedRecordError(Exception):
    """A record that cannot be read: truncated, of an impossible length, or with a wrong CRC."""


@dataclass(frozen=True, slots=True)
class Fault:
    """The offset of an unreadable part of a file, and the reason."""

    offset: int
    reason: str


def parse_record(opcode: int, body: bytes) -> Record | None:
    """Return a record from its body, or None for a kind that a reader of frames does not need.

    Raises:
        DamagedRecordError: the body does not match the opcode.
    """
    stream = ReadDataStream(BytesIO(body))
    try:
        if opcode == Opcode.MESSAGE:
            message: Message = Message.read(stream, max(len(body), 22))
            return message
        read = _READERS.get(opcode)
        return None if read is None else read(stream)
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise DamagedRecordError(f"a record of kind {opcode} is damaged") from error


def walk(file: IO[bytes], end: int) -> Iterator[tuple[int, Record | Fault]]:
    """Yield the records of `file` from its current position to `end`, each with its offset.

    A record with a damaged body yields a `Fault` and is skipped. A record with an impossible length
    yields a `Fault` and ends the iteration, since the next record cannot be found.
    """
    while (offset := file.tell()) < end:
        head = file.read(9)
        if len(head) < 9:
            yield offset, Fault(offset, "the file ends inside a record")
            return
        opcode, length = struct.unpack("<BQ", head)
        if length > min(MAX_RECORD, end - offset - 9):
            yield offset, Fault(offset, "the file ends inside a record, or its length is damaged")
            return
        try:
            record = parse_record(opcode, file.read(length))
        except DamagedRecordError as error:
            yield offset, Fault(offset, str(error))
            continue
        if record is not None:
            yield offset, record
        if isinstance(record, Footer):
            return


def unpack_chunk(chunk: Chunk) -> bytes:
    """Return the records inside `chunk`, decompressed, after a check of their CRC.

    Raises:
        DamagedRecordError: the CRC is wrong, the data do not decompress to the stated size, or that
            size exceeds the limit.
    """
    size = int(chunk.uncompressed_size)
    if size > MAX_RECORD:
        raise DamagedRecordError(f"a chunk states {size} bytes")
    try:
        if chunk.compression == "zstd":
            data = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
        elif chunk.compression == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
        elif chunk.compression == "":
            data = chunk.data
        else:
            raise DamagedRecordError(f"a chunk has the unknown compression {chunk.compression!r}")
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise DamagedRecordError("a chunk does not decompress") from error
    if len(data) != size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise DamagedRecordError("a chunk fails its checksum")
    return bytes(data)


def chunk_indexes(file: IO[bytes]) -> list[ChunkIndex] | None:
    """Return the chunk index in the summary of a finished file, or None if it is incomplete."""
    size = file.seek(0, 2)
    if size < len(MAGIC) * 2 + FOOTER_BYTES:
        return None
    file.seek(size - len(MAGIC) - FOOTER_BYTES)
    tail = file.read(FOOTER_BYTES + len(MAGIC))
    opcode, length = struct.unpack_from("<BQ", tail)
    if not tail.endswith(MAGIC) or (opcode, length) != (Opcode.FOOTER, 20):
        return None
    start, _, crc = struct.unpack_from("<QQI", tail, 9)
    footer_at = size - len(MAGIC) - FOOTER_BYTES
    if not len(MAGIC) <= start < footer_at or footer_at - start > MAX_RECORD:
        return None
    file.seek(start)
    summary = file.read(footer_at - start)
    if crc and zlib.crc32(summary + tail[:25]) != crc:
        return None
    found = [record for _, record in walk(BytesIO(summary), len(summary))]
    return [record for record in found if isinstance(record, ChunkIndex)]
