"""Layout of Bunraku's MCAP recordings: topics, schemas, and frames and skeletons as JSON.

Any MCAP tool (Foxglove, the `mcap` command) can read the files:

- metadata record ``bunraku.skeleton`` with the key ``json``, written first, outside any chunk: the
  joint names, parents and rest positions; the same JSON is the first message, on ``/skeleton``;
- metadata record ``bunraku.source``: origin and date of the frames, as short texts;
- one channel ``/performer/<id>`` per performer; each message is one frame as JSON (schema
  ``bunraku.SkeletonFrame``); `log_time` is the arrival, `publish_time` the performer's time,
  both in nanoseconds; the message repeats both as float seconds, and numbers are written with all
  their digits, so a recording is read back bit for bit; `sequence` numbers the frames on arrival
  and skips those that a slow disk lost;
- values that were not seen are ``null``;
- a frame with a face has ``blends``, the weights of its blend shapes by name; older programs ignore
  them.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from devices.blend_shapes import checked_blends
from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.skeleton import MOST_SECONDS, Skeleton, SkeletonFrame
from replay.bounds import FARTHEST_REST, MOST_JOINTS
from replay.mcap.record_reader import DamagedRecordError

SKELETON_NAME = "bunraku.skeleton"
SOURCE_NAME = "bunraku.source"
SKELETON_TOPIC = "/skeleton"
PERFORMER_TOPIC = "/performer/"

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
        "blends": {"type": "object", "additionalProperties": {"type": "number"}},
    },
}
_BAD_JSON = (ValueError, TypeError, KeyError, OverflowError)


def encode_skeleton(skeleton: Skeleton) -> str:
    """Return the JSON of a skeleton."""
    return json.dumps(
        {
            "names": skeleton.names,
            "parents": skeleton.parents.tolist(),
            "rest_positions": skeleton.rest_positions.tolist(),
        }
    )


def decode_skeleton(text: str | bytes) -> Skeleton:
    """Return the skeleton of `encode_skeleton`.

    Raises:
        InputError: the JSON does not describe a skeleton.
    """
    try:
        found = parse_json(text)
        names = tuple(str(name) for name in found["names"])
        if len(names) > MOST_JOINTS:
            raise InputError(f"its skeleton has more than {MOST_JOINTS} joints")
        rest = np.array(found["rest_positions"], dtype=np.float64)
        if not (np.abs(rest) <= FARTHEST_REST).all():
            raise InputError(f"a joint of its skeleton rests farther than {FARTHEST_REST:g} m away")
        return Skeleton(names, np.array(found["parents"], dtype=np.int64), rest)
    except _BAD_JSON as error:
        raise InputError("the skeleton in the file is damaged") from error


def encode_frame(frame: SkeletonFrame) -> bytes:
    """Return the JSON of a frame; numbers that are not finite become null."""
    fields: dict[str, object] = {
        "time": float(frame.time),
        "arrival": float(frame.arrival),
        "performer": int(frame.performer),
        "positions": np.ascontiguousarray(frame.positions),
        "confidence": np.ascontiguousarray(frame.confidence),
    }
    if frame.rotations is not None:
        fields["rotations"] = np.ascontiguousarray(frame.rotations)
    if frame.blends is not None:
        fields["blends"] = frame.blends
    # Twenty times as fast as json, which would block the interpreter during a show.
    return orjson.dumps(fields, option=orjson.OPT_SERIALIZE_NUMPY)


def decode_frame(data: bytes, joints: int) -> SkeletonFrame:
    """Decode a frame of `encode_frame`; numbers that are not finite become NaN, confidence 0.

    Raises:
        DamagedRecordError: the JSON is not a frame of `joints` joints.
    """
    try:
        found = parse_json(data)
        positions = _array(found["positions"], (joints, 3))
        confidence = np.minimum(np.maximum(_array(found["confidence"], (joints,)), 0.0), 1.0)
        confidence[np.isnan(confidence) | np.isnan(positions).any(axis=1)] = 0.0
        rotations = found.get("rotations")
        arrival, blends = found.get("arrival"), found.get("blends")
        return SkeletonFrame(
            time=_time(found["time"]),
            positions=positions,
            rotations=None if rotations is None else _array(rotations, (joints, 4)),
            confidence=confidence,
            performer=int(found.get("performer", 0)) % (1 << 31),
            arrival=float("nan") if arrival is None else _time(arrival),
            blends=checked_blends(blends.items()) if isinstance(blends, dict) else None,
        )
    except (*_BAD_JSON, AttributeError) as error:
        raise DamagedRecordError("a message is not a whole frame") from error


def _time(value: Any) -> float:
    number = float(value)
    if not abs(number) <= MOST_SECONDS:  # also for NaN
        raise ValueError(f"Expected a time, got {number}")
    return number


def _array(value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = np.array(value, dtype=np.float64)  # None becomes NaN
    if array.shape != shape:
        raise ValueError(f"Expected shape {shape}, got {array.shape}")
    array[~np.isfinite(array)] = np.nan
    return array
