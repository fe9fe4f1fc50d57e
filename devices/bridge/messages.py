"""Binary messages between publisher and subscriber, versioned and validated when decoded.

Every message is one ZeroMQ frame: the magic ``BNRK``, a version byte, a kind byte, two zero bytes,
then the fields of the kind, little-endian. The first six bytes keep their meaning in every version,
so programs of different versions can report the mismatch. The subscriber sends one kind, `Call`:
its identity, its credit, the frames received so far, and its clock. The publisher sends four:
`Answer`, `Announcement` (the skeleton), `Sample` (one frame) and, just before the sample of a frame
with a face, `FaceWeights`. Programs that do not know faces count those as refused and go on.

Numbers are float64, so a recording made by the subscriber equals one made on the capture machine,
bit for bit. A joint that was not seen is NaN with confidence 0.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.blend_shapes import Blends, checked_blends
from devices.bounded_json import parse_json
from devices.bridge.sanitize import make_safe
from devices.errors import InputError
from devices.skeleton import FARTHEST, MOST_SECONDS, Skeleton, SkeletonFrame

VERSION = 1
MAX_JOINTS = 1024
MAX_MESSAGE = 1 << 18  # bytes; a frame of 1024 joints with rotations takes a quarter of this
MAX_CREDIT = 4096
LATEST, LOSSLESS, LEAVING = 0, 1, 2
MODES = {"latest": LATEST, "lossless": LOSSLESS}

_MAGIC = b"BNRK"
_HEAD = struct.Struct("<4sBBH")
_CALL = struct.Struct("<QQQdHB")
_ANSWER = struct.Struct("<QQddd")
_SESSION = struct.Struct("<Q")
_SAMPLE = struct.Struct("<QQdIHB")
_FACE = struct.Struct("<QQ")
_ROTATIONS = 1
_FARTHEST_REST = 1000.0  # [m]
_BAD = (ValueError, TypeError, KeyError, OverflowError, InputError)


@dataclass(frozen=True, slots=True)
class Call:
    """Subscriber to publisher: heartbeat, clock request and credit.

    Attributes:
        client: random number of the subscriber, constant while it runs.
        session: the publisher's session that the subscriber has; 0 before any.
        received: highest sequence number received.
        called_at: the subscriber's clock [s].
        credit: number of frames beyond `received` that the publisher may send, 0 to `MAX_CREDIT`.
        mode: `LATEST` or `LOSSLESS`; `LEAVING` in the last message.
    """

    client: int
    session: int
    received: int
    called_at: float
    credit: int
    mode: int


@dataclass(frozen=True, slots=True)
class Answer:
    """Publisher to subscriber: reply to a call.

    Attributes:
        session: random number of this run of the publisher.
        sent: highest sequence number that this subscriber need not expect any more: sent before
            this reply, or from before it joined.
        called_at: the subscriber's clock [s] from the call.
        heard_at, answered_at: the publisher's clock [s] at receipt of the call and at this reply.
    """

    session: int
    sent: int
    called_at: float
    heard_at: float
    answered_at: float


@dataclass(frozen=True, slots=True, eq=False)
class Announcement:
    """Publisher to subscriber: the skeleton of every frame of this session."""

    session: int
    skeleton: Skeleton


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Publisher to subscriber: one frame as in `SkeletonFrame`, on the publisher's clock [s]."""

    session: int
    sequence: int
    time: float
    performer: int
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    confidence: NDArray[np.float64]

    def frame(self, time: float, arrival: float, blends: Blends | None = None) -> SkeletonFrame:
        """Return the frame with its face, at a time and arrival on the subscriber's clock [s]."""
        return SkeletonFrame(
            time=time,
            positions=self.positions,
            rotations=self.rotations,
            confidence=self.confidence,
            performer=self.performer,
            arrival=arrival,
            blends=blends,
        )


@dataclass(frozen=True, slots=True)
class FaceWeights:
    """Publisher to subscriber: the blend shapes of the frame with this sequence number."""

    session: int
    sequence: int
    blends: Blends


@dataclass(frozen=True, slots=True)
class OtherVersion:
    """A message of a program with another version of the protocol."""

    version: int


Message = Call | Answer | Announcement | Sample | FaceWeights | OtherVersion


def encode_call(call: Call) -> bytes:
    """Return the bytes of a call."""
    fields = (call.client, call.session, call.received, call.called_at, call.credit, call.mode)
    return _head(1) + _CALL.pack(*fields)


def encode_answer(answer: Answer) -> bytes:
    """Return the bytes of an answer."""
    clocks = (answer.called_at, answer.heard_at, answer.answered_at)
    return _head(2) + _ANSWER.pack(answer.session, answer.sent, *clocks)


def encode_announcement(session: int, skeleton: Skeleton) -> bytes:
    """Return the bytes of an announcement.

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
            f"at most {MAX_JOINTS} joints and {MAX_MESSAGE // 1024} KiB of names can be sent"
        )
    return data


def encode_sample(session: int, sequence: int, frame: SkeletonFrame) -> bytes:
    """Return the bytes of a frame."""
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


def encode_face(session: int, sequence: int, blends: Blends) -> bytes:
    """Return the bytes of a frame's blend shapes."""
    return (
        _head(5) + _FACE.pack(session, sequence) + json.dumps(blends, ensure_ascii=False).encode()
    )


def decode(data: bytes) -> Message | None:
    """Return the message in `data`, or None if it is not one. Never raises."""
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
    return call if known and abs(call.called_at) <= MOST_SECONDS else None


def _decode_answer(body: bytes) -> Answer | None:
    if len(body) != _ANSWER.size:
        return None
    answer = Answer(*_ANSWER.unpack(body))
    clocks = (answer.called_at, answer.heard_at, answer.answered_at)
    return answer if all(abs(clock) <= MOST_SECONDS for clock in clocks) else None


def _decode_announcement(body: bytes) -> Announcement | None:
    if len(body) < _SESSION.size:
        return None
    try:
        found = parse_json(body[_SESSION.size :])
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
    if not (sized and content in (0, _ROTATIONS) and abs(time) <= MOST_SECONDS):
        return None
    numbers = np.frombuffer(body, "<f8", offset=_SAMPLE.size).astype(np.float64)
    positions = numbers[: 3 * joints].reshape(joints, 3)
    if (np.isfinite(positions) & (np.abs(positions) > FARTHEST)).any():
        return None
    confidence = numbers[3 * joints : 4 * joints]
    rotations = numbers[4 * joints :].reshape(-1, 4)
    make_safe(positions, confidence, rotations)
    turned = rotations if content == _ROTATIONS else None
    return Sample(session, sequence, time, performer, positions, turned, confidence)


def _decode_face(body: bytes) -> FaceWeights | None:
    if len(body) < _FACE.size:
        return None
    session, sequence = _FACE.unpack_from(body)
    try:
        found = parse_json(body[_FACE.size :])
    except _BAD:
        return None
    blends = checked_blends(found.items()) if isinstance(found, dict) else None
    return None if blends is None else FaceWeights(session, sequence, blends)


_DECODERS: dict[int, Callable[[bytes], Message | None]] = {
    1: _decode_call,
    2: _decode_answer,
    3: _decode_announcement,
    4: _decode_sample,
    5: _decode_face,
}
