"""What a bridge and a stage say to each other: versioned binary messages, read without trust.

Every message is one ZeroMQ frame: the magic ``BNRK``, a version byte, a kind byte, two zero bytes,
then the kind's own fields, little-endian. The first six bytes keep their meaning in every version,
so that two programs that cannot talk can still say so. The stage says one thing, `Call`: that it is
there, what it wants, how far it has come, what its clock shows. The bridge says three: `Answer`,
`Announcement` (the skeleton) and `Sample` (one frame).

Numbers are float64, so that a recording made on the stage is the one the capture machine would
have made, bit for bit. A joint that was not seen is NaN with confidence 0.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bridge.sanitize import make_safe
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame

VERSION = 1
MAX_JOINTS = 1024
MAX_MESSAGE = 1 << 18  # bytes; a frame of 1024 joints with rotations takes a quarter of it
MAX_CREDIT = 4096
LATEST, LOSSLESS, LEAVING = 0, 1, 2
MODES = {"latest": LATEST, "lossless": LOSSLESS}

_MAGIC = b"BNRK"
_HEAD = struct.Struct("<4sBBH")
_CALL = struct.Struct("<QQQdHB")
_ANSWER = struct.Struct("<QQddd")
_SESSION = struct.Struct("<Q")
_SAMPLE = struct.Struct("<QQdIHB")
_ROTATIONS = 1
_FARTHEST_REST = 1000.0  # [m]
_BAD = (ValueError, TypeError, KeyError, OverflowError, RecursionError, InputError)


@dataclass(frozen=True, slots=True)
class Call:
    """Stage to bridge: here I am.

    Attributes:
        client: a random number that names this stage for as long as it runs.
        session: the bridge that it has heard so far; 0 before any.
        received: the highest sequence number that has come.
        called_at: its clock [s].
        credit: how many frames beyond that may be under way, 0 to `MAX_CREDIT`.
        mode: `LATEST` or `LOSSLESS`; `LEAVING` is its last word.
    """

    client: int
    session: int
    received: int
    called_at: float
    credit: int
    mode: int


@dataclass(frozen=True, slots=True)
class Answer:
    """Bridge to stage: heard.

    Attributes:
        session: a random number that names this run of the bridge.
        sent: the highest sequence number that went out to this stage before, or that it is not
            owed because it came too late for it.
        called_at: the stage's clock [s] as it was in the call.
        heard_at, answered_at: the bridge's clock [s] when the call came and when this went out.
    """

    session: int
    sent: int
    called_at: float
    heard_at: float
    answered_at: float


@dataclass(frozen=True, slots=True, eq=False)
class Announcement:
    """Bridge to stage: the skeleton of every frame of this session."""

    session: int
    skeleton: Skeleton


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Bridge to stage: one frame, as `SkeletonFrame` has it, but on the bridge's clock [s]."""

    session: int
    sequence: int
    time: float
    performer: int
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    confidence: NDArray[np.float64]

    def frame(self, time: float, arrival: float) -> SkeletonFrame:
        """The frame, at a time and with an arrival on the stage's clock [s]."""
        return SkeletonFrame(
            time=time,
            positions=self.positions,
            rotations=self.rotations,
            confidence=self.confidence,
            performer=self.performer,
            arrival=arrival,
        )


@dataclass(frozen=True, slots=True)
class OtherVersion:
    """A message of a program that speaks another version."""

    version: int


Message = Call | Answer | Announcement | Sample | OtherVersion


def encode_call(call: Call) -> bytes:
    """The bytes of a call."""
    fields = (call.client, call.session, call.received, call.called_at, call.credit, call.mode)
    return _head(1) + _CALL.pack(*fields)


def encode_answer(answer: Answer) -> bytes:
    """The bytes of an answer."""
    clocks = (answer.called_at, answer.heard_at, answer.answered_at)
    return _head(2) + _ANSWER.pack(answer.session, answer.sent, *clocks)


def encode_announcement(session: int, skeleton: Skeleton) -> bytes:
    """The bytes of an announcement.

    Raises:
        InputError: the skeleton has more than `MAX_JOINTS` joints, or its names are too long.
    """
    text = json.dumps(
        {
            "names": skeleton.names,
            "parents": skeleton.parents.tolist(),
            "rest_positions": skeleton.rest_positions.tolist(),
        }
    ).encode()
    data = _head(3) + _SESSION.pack(session) + text
    if len(skeleton.names) > MAX_JOINTS or len(data) > MAX_MESSAGE:
        raise InputError(
            f"a skeleton of {len(skeleton.names)} joints is too large for a bridge; "
            f"at most {MAX_JOINTS} joints and {MAX_MESSAGE // 1024} KiB of names can go over it"
        )
    return data


def encode_sample(session: int, sequence: int, frame: SkeletonFrame) -> bytes:
    """The bytes of a frame."""
    rotations = frame.rotations
    head = (session, sequence, frame.time, frame.performer & 0xFFFFFFFF, len(frame.positions))
    arrays = [frame.positions, frame.confidence, *([] if rotations is None else [rotations])]
    return b"".join(
        [
            _head(4),
            _SAMPLE.pack(*head, 0 if rotations is None else _ROTATIONS),
            *(array.astype("<f8", copy=False).tobytes() for array in arrays),
        ]
    )


def decode(data: bytes) -> Message | None:
    """The message in `data`; None for anything else. Never raises, whatever the bytes are."""
    if not _HEAD.size <= len(data) <= MAX_MESSAGE:
        return None
    magic, version, kind, reserved = _HEAD.unpack_from(data)
    if magic != _MAGIC:
        return None
    if version != VERSION:
        return OtherVersion(version)
    if reserved != 0 or kind not in _DECODERS:
        return None
    return _DECODERS[kind](data[_HEAD.size :])


def _head(kind: int) -> bytes:
    return _HEAD.pack(_MAGIC, VERSION, kind, 0)


def _decode_call(body: bytes) -> Call | None:
    if len(body) != _CALL.size:
        return None
    call = Call(*_CALL.unpack(body))
    known = call.mode in (LATEST, LOSSLESS, LEAVING) and call.credit <= MAX_CREDIT
    return call if known and math.isfinite(call.called_at) else None


def _decode_answer(body: bytes) -> Answer | None:
    if len(body) != _ANSWER.size:
        return None
    answer = Answer(*_ANSWER.unpack(body))
    clocks = (answer.called_at, answer.heard_at, answer.answered_at)
    return answer if all(map(math.isfinite, clocks)) else None


def _decode_announcement(body: bytes) -> Announcement | None:
    if len(body) < _SESSION.size:
        return None
    try:
        found = json.loads(body[_SESSION.size :])
        names = found["names"]
        if not (len(names) <= MAX_JOINTS and all(isinstance(name, str) for name in names)):
            return None
        rest = np.array(found["rest_positions"], dtype=np.float64)
        if not (np.abs(rest) <= _FARTHEST_REST).all():
            return None
        parents = np.array(found["parents"], dtype=np.int64)
        (session,) = _SESSION.unpack_from(body)
        return Announcement(session, Skeleton(tuple(names), parents, rest))
    except _BAD:
        return None


def _decode_sample(body: bytes) -> Sample | None:
    if len(body) < _SAMPLE.size:
        return None
    session, sequence, time, performer, joints, content = _SAMPLE.unpack_from(body)
    columns = 8 if content == _ROTATIONS else 4
    sized = len(body) == _SAMPLE.size + 8 * columns * joints and 1 <= joints <= MAX_JOINTS
    if not (sized and content in (0, _ROTATIONS) and math.isfinite(time)):
        return None
    numbers = np.frombuffer(body, "<f8", offset=_SAMPLE.size).astype(np.float64)
    positions = numbers[: 3 * joints].reshape(joints, 3)
    confidence = numbers[3 * joints : 4 * joints]
    rotations = numbers[4 * joints :].reshape(-1, 4)
    make_safe(positions, confidence, rotations)
    turned = rotations if content == _ROTATIONS else None
    return Sample(session, sequence, time, performer, positions, turned, confidence)


_DECODERS: dict[int, Callable[[bytes], Message | None]] = {
    1: _decode_call,
    2: _decode_answer,
    3: _decode_announcement,
    4: _decode_sample,
}
