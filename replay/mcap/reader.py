"""Bunraku's own recording: an MCAP file that holds its skeleton, every frame, and both clocks.

Layout, so that any MCAP tool (Foxglove, the `mcap` command) can read it:

- metadata record ``bunraku.skeleton`` with the key ``json``, written first, outside any chunk: the
  joint names, parents and rest positions; the same JSON is the first message, on ``/skeleton``;
- metadata record ``bunraku.source``: where the frames came from and when, as short texts;
- one channel ``/performer/<id>`` a performer; each message is one frame as JSON (schema
  ``bunraku.SkeletonFrame``); `log_time` is when it came in, `publish_time` the performer's own
  time, both in nanoseconds; the message repeats both as the float seconds that they were, and a
  number is written with all its digits, so that a recording reads back bit for bit; `sequence`
  numbers the frames as they came, and leaves out those that the disk was too slow for;
- what was not seen is ``null``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, Self

import numpy as np
import orjson
from mcap.records import Channel, Chunk, Message, Metadata
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
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

SKELETON_NAME = "bunraku.skeleton"
SOURCE_NAME = "bunraku.source"
SKELETON_TOPIC = "/skeleton"
PERFORMER_TOPIC = "/performer/"
FARTHEST_REST = 1000.0  # [m]
MOST_SOURCE_FACTS = 64

_NUMBER = {"type": ["number", "null"]}
_ROWS = {"type": "array", "items": {"type": "array", "items": _NUMBER}}
SKELETON_SCHEMA: dict[str, object] = {
    "title": "bunraku.Skeleton",
    "type": "object",
    "properties": {
        "names": {"type": "array", "items": {"type": "string"}},
        "parents": {"type": "array", "items": {"type": "integer"}},
        "rest_positions": _ROWS,
    },
}
FRAME_SCHEMA: dict[str, object] = {
    "title": "bunraku.SkeletonFrame",
    "type": "object",
    "properties": {
        "time": {"type": "number"},
        "arrival": _NUMBER,
        "performer": {"type": "integer"},
        "positions": _ROWS,
        "confidence": {"type": "array", "items": {"type": "number"}},
        "rotations": _ROWS,
    },
}
_BAD_JSON = (ValueError, TypeError, KeyError, OverflowError, RecursionError)


def encode_skeleton(skeleton: Skeleton) -> str:
    """The JSON of a skeleton."""
    return json.dumps(
        {
            "names": skeleton.names,
            "parents": skeleton.parents.tolist(),
            "rest_positions": skeleton.rest_positions.tolist(),
        }
    )


def decode_skeleton(text: str | bytes) -> Skeleton:
    """The skeleton of `encode_skeleton`.

    Raises:
        InputError: the JSON does not describe a skeleton.
    """
    try:
        found = json.loads(text)
        names = tuple(str(name) for name in found["names"])
        rest = np.array(found["rest_positions"], dtype=np.float64)
        if not (np.abs(rest) <= FARTHEST_REST).all():
            raise InputError(f"a joint of its skeleton rests farther than {FARTHEST_REST:g} m away")
        return Skeleton(names, np.array(found["parents"], dtype=np.int64), rest)
    except _BAD_JSON as error:
        raise InputError("the skeleton in the file is damaged") from error


def encode_frame(frame: SkeletonFrame) -> bytes:
    """The JSON of a frame; what is not finite becomes null."""
    fields = {
        "time": float(frame.time),
        "arrival": float(frame.arrival),
        "performer": int(frame.performer),
        "positions": np.ascontiguousarray(frame.positions),
        "confidence": np.ascontiguousarray(frame.confidence),
    }
    if frame.rotations is not None:
        fields["rotations"] = np.ascontiguousarray(frame.rotations)
    # Twenty times as fast as json, which would keep the interpreter from a show that goes on.
    return orjson.dumps(fields, option=orjson.OPT_SERIALIZE_NUMPY)


def decode_frame(data: bytes, joints: int) -> SkeletonFrame:
    """The frame of `encode_frame`; numbers that are not finite become NaN with confidence 0.

    Raises:
        DamagedRecordError: the JSON is not a frame of `joints` joints.
    """
    try:
        found = json.loads(data)
        positions = _array(found["positions"], (joints, 3))
        confidence = np.clip(np.nan_to_num(_array(found["confidence"], (joints,))), 0.0, 1.0)
        confidence[~np.isfinite(positions).all(axis=1)] = 0.0
        rotations = found.get("rotations")
        arrival = found.get("arrival")
        return SkeletonFrame(
            time=_finite_number(found["time"]),
            positions=positions,
            rotations=None if rotations is None else _array(rotations, (joints, 4)),
            confidence=confidence,
            performer=int(found.get("performer", 0)) % (1 << 31),
            arrival=float("nan") if arrival is None else _finite_number(arrival),
        )
    except (*_BAD_JSON, AttributeError) as error:
        raise DamagedRecordError("a message is not a whole frame") from error


def _finite_number(value: Any) -> float:
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"Expected a finite number, got {number}")
    return number


def _array(value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = np.array(value, dtype=np.float64)  # None becomes NaN
    if array.shape != shape:
        raise ValueError(f"Expected shape {shape}, got {array.shape}")
    array[~np.isfinite(array)] = np.nan
    return array


def recognises_mcap(path: Path, head: bytes) -> bool:
    """Whether a file begins as MCAP files do."""
    return head.startswith(MAGIC)


class McapReader:
    """The frames of a native recording, one by one, from any time on; a context manager.

    A finished file is entered through its chunk index, one that was cut is read from the front.

    Attributes:
        skeleton: the skeleton of every frame.
        source: what the file says of where its frames come from.
        missing: frames that came, by their numbers, but were not found so far.
        faults: what could not be read so far; the frames around it are given all the same.

    Raises:
        InputError: the file cannot be read, is no MCAP file, or holds no skeleton.
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
    def indexed(self) -> bool:
        """Whether the file is finished, with a whole index."""
        return self._indexes is not None

    def frames(self, since: float = float("-inf")) -> Iterator[SkeletonFrame]:
        """The frames that came in at `since` [s, the clock of the file] or later, in file order."""
        topics: dict[int, str] = {}
        joints = len(self.skeleton.names)
        earliest = since * 1e9
        self.missing, expected = 0, None
        for offset, record in self._records(earliest):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and record.log_time >= earliest:
                # The chunk that named the channel may be damaged or passed over: then try.
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
        raise InputError(
            f"{self.path} is an MCAP file without a skeleton of Bunraku's; "
            "only recordings made by `bunraku record` or `--record` can be replayed"
        )

    def _skeleton(self, text: str | bytes) -> Skeleton:
        try:
            return decode_skeleton(text)
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from error

    def _records(self, earliest: float) -> Iterator[tuple[int, Record]]:
        """Records outside and inside chunks, without the chunks that end before `earliest` [ns]."""
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
    """The whole native recording at `path`, finished or cut off by a crash.

    Whatever is whole is read; what is not is told in the notes. Times are counted from the first
    frame of the performers' clock, arrivals from the same moment, so that latencies remain.

    Raises:
        InputError: the file cannot be read, is no recording of Bunraku's, or holds no whole frame.
    """
    with McapReader(path) as reader:
        frames = list(reader.frames())
        notes = _notes(reader, len(frames))
        skeleton, source = reader.skeleton, reader.source
    if not frames:
        raise InputError(f"{path} holds a skeleton but no whole frame")
    return stack_frames(skeleton, frames, notes, source)


def stack_frames(
    skeleton: Skeleton,
    frames: list[SkeletonFrame],
    notes: tuple[str, ...] = (),
    source: Mapping[str, str] | None = None,
) -> Recording:
    """A recording of `frames` (one or more), in order of time, which is counted from the first."""
    times = np.array([frame.time for frame in frames])
    order = np.argsort(times, kind="stable")
    start = times[order[0]]
    if (np.diff(order) < 0).any():
        notes += ("frames were not in the order of the performers' time; sorted",)
    rotations = None
    if any(frame.rotations is not None for frame in frames):
        unknown = np.full((len(skeleton.names), 4), np.nan)
        rotations = np.stack([unknown if (r := frames[i].rotations) is None else r for i in order])
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
    )


def _notes(reader: McapReader, count: int) -> tuple[str, ...]:
    notes = tuple(f"at byte {fault.offset}: {fault.reason}" for fault in reader.faults[:8])
    if len(reader.faults) > 8:
        notes += (f"and {len(reader.faults) - 8} faults more",)
    if reader.missing:
        notes += (
            f"{reader.missing} frames came but are not in the file: the disk was too slow, "
            "or that part of it is damaged",
        )
    if not reader.indexed:
        notes += (f"the recording was never finished; {count} whole frames were recovered",)
    return notes
