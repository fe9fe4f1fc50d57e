"""Writes MCAP records to a file that grows by whole records only; a compact index is in memory.

The library's own writer keeps some 800 bytes per chunk until the end, cannot flush an unfinished
chunk, and leaves half a record behind when the disk is full. This writer keeps the index as the
bytes that it becomes, and truncates a record that did not fit. Specification: https://mcap.dev/spec
"""

from __future__ import annotations

import os
import stat
import struct
import zlib
from collections import Counter
from contextlib import suppress
from pathlib import Path

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from replay.mcap.record_reader import MAGIC

CHUNK_BYTES = 1 << 20
_MESSAGE = struct.Struct("<BQHIQQ")  # its head: opcode, size, channel, sequence, two times
_OPCODE_AND_SIZE = 9  # bytes that a record's size does not include
_ZSTD_LEVEL = 1  # on frames in JSON both smaller and faster than the default 3


class McapRecordWriter:
    """Writes records to a new MCAP file: metadata at once, messages in chunks compressed by zstd.

    Only `flush`, `metadata`, `finish` and a full chunk (1 MiB) write to the file.

    Args:
        path: of the file; an existing file is replaced.

    Raises:
        OSError: the file cannot be created or written; the same holds for all methods.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb", buffering=0)
        self._regular = stat.S_ISREG(os.fstat(self._file.fileno()).st_mode)
        self._offset = 0
        self._compressor = zstandard.ZstdCompressor(level=_ZSTD_LEVEL)
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._counts: Counter[int] = Counter()
        self._metadata_index = bytearray()
        self._chunk_index = bytearray()
        self._chunks = self._metadatas = 0
        self._times: tuple[int, int] | None = None  # of all messages, first and last [ns]
        # The records of the current chunk, in one buffer for all chunks: buffers of varying sizes
        # would fragment the memory of a long show.
        self._room = bytearray(2 * CHUNK_BYTES)
        self._filled = 0
        self._entries: dict[int, list[tuple[int, int]]] = {}
        self._chunk_times: tuple[int, int] | None = None
        try:
            self._write(MAGIC + _bytes_of(Header(profile="", library="bunraku")))
        except OSError:
            self.close()
            raise

    @property
    def descriptor(self) -> int:
        """File descriptor of the open file, for `os.fsync`."""
        return self._file.fileno()

    @property
    def regular(self) -> bool:
        """Whether it is a file on a disk, not a device or a pipe."""
        return self._regular

    def metadata(self, name: str, data: dict[str, str]) -> None:
        """Write a metadata record now, outside any chunk."""
        self.flush()
        record = _bytes_of(Metadata(name=name, metadata=data))
        index = MetadataIndex(offset=self._offset, length=len(record), name=name)
        self._write(record)
        self._metadata_index += _bytes_of(index)
        self._metadatas += 1

    def schema(self, name: str, text: str) -> int:
        """Declare a JSON schema; return its number."""
        number = len(self._schemas) + 1
        self._schemas.append(Schema(number, text.encode(), "jsonschema", name))
        self._append(_bytes_of(self._schemas[-1]))
        return number

    def channel(self, topic: str, schema: int) -> int:
        """Open a channel of JSON messages; return its number."""
        number = len(self._channels) + 1
        self._channels.append(Channel(number, topic, "json", {}, schema))
        self._append(_bytes_of(self._channels[-1]))
        return number

    def message(
        self, channel: int, data: bytes, *, log_time: int, publish_time: int, sequence: int
    ) -> None:
        """Append a message to the chunk; times in nanoseconds."""
        self._entries.setdefault(channel, []).append((log_time, self._filled))
        size = _MESSAGE.size - _OPCODE_AND_SIZE + len(data)
        self._append(_MESSAGE.pack(Opcode.MESSAGE, size, channel, sequence, log_time, publish_time))
        self._append(data)
        self._chunk_times = _spanning(self._chunk_times, (log_time, log_time))
        if self._filled >= CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Pass all messages to the system as one chunk, with its index."""
        if not self._entries:
            return
        size, entries = self._filled, self._entries
        start, end = self._chunk_times or (0, 0)
        self._filled, self._entries, self._chunk_times = 0, {}, None
        with memoryview(self._room)[:size] as data:
            crc, packed = zlib.crc32(data), self._compressor.compress(data)
        chunk = _bytes_of(Chunk("zstd", packed, end, start, crc, size))
        index, offsets = b"", {}
        for channel, places in entries.items():
            offsets[channel] = self._offset + len(chunk) + len(index)
            index += _bytes_of(MessageIndex(channel, places))
        begun = self._offset
        self._write(chunk + index)
        self._chunks += 1
        self._times = _spanning(self._times, (start, end))
        for channel, places in entries.items():
            self._counts[channel] += len(places)
        self._chunk_index += _bytes_of(
            ChunkIndex(
                chunk_length=len(chunk),
                chunk_start_offset=begun,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=end,
                message_index_length=len(index),
                message_index_offsets=offsets,
                message_start_time=start,
                uncompressed_size=size,
            )
        )

    def finish(self) -> None:
        """Write the remaining chunk, the summary and the footer."""
        self.flush()
        end = _bytes_of(DataEnd(data_section_crc=0))  # 0: not computed
        summary_start = self._offset + len(end)
        summary, offsets = b"", b""
        for opcode, group in (
            (Opcode.SCHEMA, b"".join(map(_bytes_of, self._schemas))),
            (Opcode.CHANNEL, b"".join(map(_bytes_of, self._channels))),
            (Opcode.STATISTICS, _bytes_of(self._statistics())),
            (Opcode.CHUNK_INDEX, bytes(self._chunk_index)),
            (Opcode.METADATA_INDEX, bytes(self._metadata_index)),
        ):
            if group:
                start = summary_start + len(summary)
                offsets += _bytes_of(SummaryOffset(opcode, start, len(group)))
                summary += group
        offset_start = summary_start + len(summary)
        summary += offsets
        head = struct.pack("<BQQQ", Opcode.FOOTER, 20, summary_start, offset_start)
        crc = zlib.crc32(head, zlib.crc32(summary))
        footer = _bytes_of(Footer(summary_start, offset_start, crc))
        self._write(end + summary + footer + MAGIC)

    def close(self) -> None:
        """Close the file as it is; may be called twice."""
        self._file.close()

    def _statistics(self) -> Statistics:
        first, last = self._times or (0, 0)
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=self._chunks,
            message_count=self._counts.total(),
            message_end_time=last,
            message_start_time=first,
            metadata_count=self._metadatas,
            schema_count=len(self._schemas),
        )

    def _append(self, record: bytes) -> None:
        end = self._filled + len(record)
        self._room[self._filled : end] = record  # grows the buffer if necessary
        self._filled = end

    def _write(self, data: bytes) -> None:
        """Write all of `data`, or nothing of it and raise OSError."""
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) or 0 :]
        except OSError:
            if self._regular:
                with suppress(OSError):
                    os.ftruncate(self.descriptor, self._offset)
            raise
        self._offset += len(data)


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]  # mcap's builder has no types
    return data


def _spanning(one: tuple[int, int] | None, other: tuple[int, int]) -> tuple[int, int]:
    return other if one is None else (min(one[0], other[0]), max(one[1], other[1]))
