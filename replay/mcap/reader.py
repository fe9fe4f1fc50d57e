"""Read Bunraku's MCAP recordings, finished or truncated (layout: `replay.mcap.frame_json`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Self

import numpy as np
from mcap.records import Channel, Chunk, Message, Metadata

from devices.blend_shapes import Blends
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.mcap.frame_json import (
    PERFORMER_TOPIC,
    SKELETON_NAME,
    SKELETON_TOPIC,
    SOURCE_NAME,
    decode_frame,
    decode_skeleton,
)
from replay.mcap.record_reader import (
    MAGIC,
    DamagedRecordError,
    Fault,
    Record,
    chunk_indexes,
    parse_record,
    unpack_chunk,
    walk,
)
from replay.recording import Recording

MOST_SOURCE_FACTS = 64
FRAMES_OF_ANY = 100_000  # are read of any file, in some seconds
SHORTEST_FRAME = 20  # [bytes] of each frame of a larger file; its index alone takes 16
MOST_MEMORY = 1500 << 20  # [bytes] that the frames may take, or `MOST_TIMES` the file
MOST_TIMES = 8
_FRAME, _JOINT = 1024, 128  # [bytes] of a frame and each joint, while they are put together


def recognises_mcap(path: Path, head: bytes) -> bool:
    """Whether a file begins with MCAP's magic bytes."""
    return head.startswith(MAGIC)


class McapReader:
    """Frames of a native recording, one by one, from any time on; a context manager.

    A finished file is accessed by its chunk index, a truncated one is read from the front.

    Attributes:
        skeleton: the skeleton of every frame.
        source: what the file states about the origin of its frames.
        missing: recorded frames, by their numbers, that were not found so far.
        faults: unreadable parts so far; the frames around them are read.

    Raises:
        InputError: the file cannot be read, is not an MCAP file, or holds no skeleton.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.faults: list[Fault] = []
        self.source: dict[str, str] = {}
        self.missing = 0
        try:
            self._file = path.open("rb")
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror or error}") from error
        try:
            self._size = self._file.seek(0, 2)
            self._indexes = chunk_indexes(self._file)
            self._file.seek(0)
            if self._file.read(len(MAGIC)) != MAGIC:
                raise InputError(f"{path} is not an MCAP file: its first bytes are wrong")
            self.skeleton = self._find_skeleton()
        except InputError:
            self._file.close()
            raise

    @property
    def size(self) -> int:
        """Of the file [bytes]."""
        return self._size

    @property
    def indexed(self) -> bool:
        """Whether the file is finished, with a complete index."""
        return self._indexes is not None

    def frames(self, since: float = float("-inf")) -> Iterator[SkeletonFrame]:
        """Yield the frames that came in at `since` [s, file's clock] or later, in file order."""
        topics: dict[int, str] = {}
        joints = len(self.skeleton.names)
        earliest = since * 1e9
        self.missing, expected = 0, None
        for offset, record in self._records(earliest):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and record.log_time >= earliest:
                # The chunk that named the channel may be damaged or skipped: accept the message.
                if not topics.get(record.channel_id, PERFORMER_TOPIC).startswith(PERFORMER_TOPIC):
                    continue
                if expected is not None and record.sequence > expected:
                    self.missing += record.sequence - expected
                expected = record.sequence + 1
                try:
                    yield decode_frame(record.data, joints)
                except DamagedRecordError as error:
                    self.faults.append(Fault(offset, str(error)))

    def close(self) -> None:
        """Close the file; may be called twice."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _find_skeleton(self) -> Skeleton:
        topics: dict[int, str] = {}
        for _, record in self._records(float("-inf")):
            if isinstance(record, Metadata) and record.name == SOURCE_NAME:
                self.source = dict(islice(record.metadata.items(), MOST_SOURCE_FACTS))
            if isinstance(record, Metadata) and record.name == SKELETON_NAME:
                return self._skeleton(record.metadata.get("json", ""))
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            if isinstance(record, Message) and topics.get(record.channel_id) == SKELETON_TOPIC:
                return self._skeleton(record.data)
        if not self._is_whole():
            raise InputError(f"{self.path} is cut off before its skeleton; copy it again")
        raise InputError(
            f"{self.path} is an MCAP file without a Bunraku skeleton; "
            "only recordings made by `bunraku record` or `--record` can be replayed"
        )

    def _is_whole(self) -> bool:
        """Whether the file ends as a finished MCAP file does."""
        self._file.seek(max(self._size - len(MAGIC), 0))
        return self._file.read(len(MAGIC)) == MAGIC

    def _skeleton(self, text: str | bytes) -> Skeleton:
        try:
            return decode_skeleton(text)
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from error

    def _records(self, earliest: float) -> Iterator[tuple[int, Record]]:
        """Records outside and inside chunks, without chunks that end before `earliest` [ns]."""
        self.faults = []
        start = len(MAGIC)
        if self._indexes and earliest > 0:
            late = [c.chunk_start_offset for c in self._indexes if c.message_end_time >= earliest]
            start = min(late, default=self._size)
        self._file.seek(start)
        for offset, record in walk(self._file, self._size):
            if isinstance(record, Fault):
                self.faults.append(record)
            elif isinstance(record, Chunk):
                if record.message_end_time >= earliest:
                    yield from self._inside(offset, record)
            else:
                yield offset, record

    def _inside(self, offset: int, chunk: Chunk) -> Iterator[tuple[int, Record]]:
        try:
            data = unpack_chunk(chunk)
        except DamagedRecordError as error:
            self.faults.append(Fault(offset, str(error)))
            return
        at = 0
        while at + 9 <= len(data):
            length = int.from_bytes(data[at + 1 : at + 9], "little")
            try:
                record = parse_record(data[at], data[at + 9 : at + 9 + length])
            except DamagedRecordError as error:
                self.faults.append(Fault(offset, str(error)))
            else:
                if isinstance(record, Channel | Message):
                    yield offset, record
            at += 9 + length


def read_mcap(path: Path) -> Recording:
    """Read the native recording at `path`, finished or truncated by a crash.

    Every intact frame is read; faults are reported in the notes. Times are counted from the first
    frame on the performers' clock, arrivals from the same moment, so that latencies are kept.

    Raises:
        InputError: the file cannot be read, is not a Bunraku recording, or holds no whole frame.
    """
    with McapReader(path) as reader:
        frames = _bounded(reader)
        notes = _notes(reader, len(frames))
        skeleton, source = reader.skeleton, reader.source
    if not frames:
        raise InputError(f"{path} holds a skeleton but no whole frame")
    return stack_frames(skeleton, frames, notes, source)


def most_frames(joints: int, size: int) -> int:
    """The most frames that are read from a file, by its size and the memory.

    Compressed chunks can hold thousands of times their size.

    Args:
        joints: of each frame.
        size: of the file [bytes].
    """
    memory = max(MOST_MEMORY, MOST_TIMES * size)
    return min(max(FRAMES_OF_ANY, size // SHORTEST_FRAME), memory // (_FRAME + _JOINT * joints))


def _bounded(reader: McapReader) -> list[SkeletonFrame]:
    """All frames, of which there are no more than `most_frames`."""
    most = most_frames(len(reader.skeleton.names), reader.size)
    frames = list(islice(reader.frames(), most + 1))
    if len(frames) > most:
        raise InputError(
            f"{reader.path}: it holds more than {most} frames, too many for its size; "
            "split the recording"
        )
    return frames


def stack_frames(
    skeleton: Skeleton,
    frames: list[SkeletonFrame],
    notes: tuple[str, ...] = (),
    source: Mapping[str, str] | None = None,
) -> Recording:
    """Return a recording of one or more `frames`, sorted by time and counted from the first."""
    times = np.array([frame.time for frame in frames])
    order = np.argsort(times, kind="stable")
    start = times[order[0]]
    if (np.diff(order) < 0).any():
        notes += ("frames were not in order of the performers' time and were sorted",)
    rotations = None
    if any(frame.rotations is not None for frame in frames):
        unknown = np.full((len(skeleton.names), 4), np.nan)
        rotations = np.stack([unknown if (r := frames[i].rotations) is None else r for i in order])
    blends = _shared(frames[i].blends for i in order)
    return Recording(
        skeleton=skeleton,
        times=times[order] - start,
        positions=np.stack([frames[i].positions for i in order]),
        rotations=rotations,
        confidence=np.stack([frames[i].confidence for i in order]),
        performers=np.array([frames[i].performer for i in order], dtype=np.int64),
        arrivals=np.array([frames[i].arrival for i in order]) - start,
        notes=notes,
        source=dict(source or {}),
        blends=blends if any(face is not None for face in blends) else None,
    )


def _shared(faces: Iterable[Blends | None]) -> tuple[Blends | None, ...]:
    """The faces; one that repeats the face before is the same object, and takes no room."""
    shared: list[Blends | None] = []
    for face in faces:
        shared.append(shared[-1] if shared and shared[-1] == face else face)
    return tuple(shared)


def _notes(reader: McapReader, count: int) -> tuple[str, ...]:
    notes = tuple(f"at byte {fault.offset}: {fault.reason}" for fault in reader.faults[:8])
    if len(reader.faults) > 8:
        notes += (f"and {len(reader.faults) - 8} more faults",)
    if reader.missing:
        notes += (
            f"{reader.missing} recorded frames are not in the file: the disk was too slow, "
            "or that part of it is damaged",
        )
    if not reader.indexed:
        notes += (f"the recording was not finished; {count} whole frames were recovered",)
    return notes
