"""Read recordings of the Leap Motion's WebSocket messages.

Three kinds of file hold the same messages: one JSON object per line (first a header with the
protocol version), one JSON document with a list of frames (LeapJS Playback, also in its packed
form, in which the first frame is the scheme of the others), and that document compressed by
lz-string. Protocol 6 gives the bones of every finger and the side of each hand; earlier protocols
give only palms and finger tips (`devices.leap.tips` assigns them).

Millimetres in device axes become metres as in `devices.leap.joints`. A frame without a hand is
kept, also at the ends of a recording, with every joint NaN and confidence 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.bounded_json import parse_json
from devices.errors import InputError
from devices.leap.hands import Hand, LeapFrame, leap_frame
from devices.leap.joints import (
    PALM,
    ROOT,
    SIDES,
    chest,
    hand_skeleton,
    leap_to_world,
)
from devices.leap.tips import name_tips
from devices.skeleton import Skeleton
from replay.bounds import check_poses
from replay.leap.lz_string import lz_pieces
from replay.recording import Recording

Array = NDArray[np.float64]

MAX_BYTES = 128 << 20  # of a JSON document, decompressed
MAX_LINE = 1 << 20
MAX_FRAMES = 1_000_000
USUAL_RATE = 110.0  # frames/s if the file does not state a rate

_MARKS = (b'"pointables"', b'"interactionBox"', b'"palmPosition"', b'"LeapJS')
_LZ_BEGINNINGS = ('{"frames"', '{"metadata"')


def recognises_leap(path: Path, head: bytes) -> bool:
    """Whether a file begins with Leap messages, plain or compressed."""
    text = head.lstrip()
    if text[:1] in (b"{", b"["):
        return any(mark in head for mark in _MARKS)
    return _lz_beginning(text).startswith(_LZ_BEGINNINGS)


def read_leap(path: Path) -> Recording:
    """Read the Leap messages at `path`.

    Raises:
        InputError: the file cannot be read, is damaged, or shows no hand in any frame.
    """
    notes: list[str] = []
    try:
        frames = [leap_frame(message) for message in _messages(path, notes)]
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        raise InputError(
            f"{path} is a damaged or truncated Leap recording: {_short(error)}"
        ) from error
    if not any(hand.joints for frame in frames for hand in frame.hands):
        raise InputError(f"{path} is a Leap recording, but no frame shows a hand")
    times = _times(frames, notes)
    tracks = follow_hands(frames)
    if any(hand.tips for track in tracks.values() for hand in track if hand):
        notes += name_tips(tracks)
    try:
        return _recording(tracks, times, tuple(notes))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _short(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return (text[:117] + "...") if len(text) > 120 else text or type(error).__name__


# -- messages -------------------------------------------------------------------------------------


def _messages(path: Path, notes: list[str]) -> Iterator[dict[str, Any]]:
    with path.open("rb") as file:
        first = file.readline(MAX_LINE)
        file.seek(0)
        if _is_one_line(first) and path.stat().st_size > len(first):
            yield from _line_messages(file, notes)
            return
        text = file.read(MAX_BYTES + 1)
    if len(text) > MAX_BYTES:
        raise ValueError(f"it is larger than {MAX_BYTES >> 20} MiB")
    if text.lstrip()[:1] not in (b"{", b"["):
        yield from _document_messages(parse_json(_decompress(text.strip())))
    else:
        yield from _document_messages(parse_json(text))


def _is_one_line(line: bytes) -> bool:
    try:
        return isinstance(parse_json(line), dict)
    except ValueError:
        return False


def _line_messages(file: Iterable[bytes], notes: list[str]) -> Iterator[dict[str, Any]]:
    bad = count = 0
    for line in file:
        try:
            message = parse_json(line) if len(line) <= MAX_LINE else None
        except ValueError:
            message = None
        if not isinstance(message, dict):
            bad += bool(line.strip())
        elif "hands" in message:
            count += 1
            if count > MAX_FRAMES:
                raise ValueError(f"it holds more than {MAX_FRAMES} frames")
            yield message
    if bad:
        notes.append(f"{bad} lines are not messages (a stopped recorder truncates the last one)")


def _decompress(text: bytes) -> str:
    pieces, size = [], 0
    for piece in lz_pieces(text):
        size += len(piece)
        if size > MAX_BYTES:
            raise ValueError(f"it unpacks to more than {MAX_BYTES >> 20} MiB")
        pieces.append(piece)
    return "".join(pieces)


def _lz_beginning(text: bytes) -> str:
    beginning = ""
    try:
        for piece in lz_pieces(text):
            beginning += piece
            if len(beginning) > 16:
                break
    except ValueError:
        pass
    return beginning


def _document_messages(document: Any) -> Iterator[dict[str, Any]]:
    frames = document.get("frames") if isinstance(document, dict) else document
    if not isinstance(frames, list):
        raise ValueError("it has no list of frames")
    if len(frames) > MAX_FRAMES:
        raise ValueError(f"it holds more than {MAX_FRAMES} frames")
    if frames and isinstance(frames[0], list):
        frames = [_unpack(frames[0], frame) for frame in frames[1:]]
    for frame in frames:
        if not isinstance(frame, dict):
            raise ValueError("a frame of it is not an object")
        yield frame


def _unpack(scheme: Any, values: Any) -> dict[str, Any]:
    """An object of LeapJS Playback's packed form: names in `scheme`, values in the same order.

    A name alone stands for a value; {name: [names]} for an object; {name: [[names]]} for a list.
    """
    if not isinstance(values, list):
        raise ValueError("a packed frame of it is not a list")
    found: dict[str, Any] = {}
    for key, value in zip(scheme, values, strict=False):
        if isinstance(key, str):
            found[key] = value
            continue
        if not isinstance(key, dict) or len(key) != 1:
            raise ValueError("the scheme of its packed frames is damaged")
        ((name, inner),) = key.items()
        if inner and isinstance(inner[0], list):
            found[name] = [_unpack(inner[0], item) for item in value]
        else:
            found[name] = _unpack(inner, value)
    return found


# -- from frames to a recording -------------------------------------------------------------------


def _times(frames: Sequence[LeapFrame], notes: list[str]) -> Array:
    """Times (T,) [s] from the device's clock; from the stated rate if a time is missing."""
    stamps = [frame.timestamp for frame in frames]
    known = [stamp for stamp in stamps if stamp is not None]
    if len(known) < len(frames):
        rates = [frame.rate for frame in frames if frame.rate is not None and frame.rate > 0]
        rate = float(np.median(rates)) if rates else USUAL_RATE
        notes.append(f"times are missing; {rate:.1f} frames a second are assumed")
        return np.arange(len(frames)) / rate
    if any(later < earlier for earlier, later in pairwise(known)):
        notes.append("the device's clock goes back; those frames get the time before")
    return (np.maximum.accumulate(np.array(known)) - known[0]) * 1e-6


def follow_hands(frames: Sequence[LeapFrame]) -> dict[str, list[Hand | None]]:
    """Return each side's hand in every frame, or None; side "" if two hands never appear together.

    Ids change when a hand is lost. A hand keeps its side while it keeps its id. A new id takes the
    side that the device gives, else the free side, else (both are new) the side it is on.
    """
    two = any(len({hand.side or hand.id for hand in frame.hands}) > 1 for frame in frames)
    sides = SIDES if two else ("",)
    tracks: dict[str, list[Hand | None]] = {side: [] for side in sides}
    ids: dict[str, int] = {}
    for frame in frames:
        now = _sides(frame.hands, sides, ids)
        ids = {side: hand.id for side, hand in now.items()}
        for side in sides:
            tracks[side].append(now.get(side))
    return tracks


def _sides(hands: list[Hand], sides: tuple[str, ...], previous: dict[str, int]) -> dict[str, Hand]:
    """The hand of each side in a frame; `previous` has the ids of the frame before."""
    found: dict[str, Hand] = {}
    ids = {hand_id: side for side, hand_id in previous.items()}
    # Present hands come first, then the more confident; others from left to right.
    for hand in sorted(
        hands, key=lambda h: (h.id not in ids, -h.confidence, float(h.joints[PALM][0]))
    ):
        side = "" if sides == ("",) else (hand.side or ids.get(hand.id, ""))
        if side not in sides:
            free = [one for one in sides if one not in found]
            middle = "left" if hand.joints[PALM][0] < 0 else "right"
            side = middle if middle in free and len(hands) == 1 else next(iter(free), middle)
        found.setdefault(side, hand)
    return found


def _recording(
    tracks: dict[str, list[Hand | None]], times: Array, notes: tuple[str, ...]
) -> Recording:
    sides = tuple(side for side in tracks if side)
    hands = [hand for track in tracks.values() for hand in track if hand is not None]
    joints = {name for hand in hands for name in hand.joints}
    left = 2 * sum(hand.side == "left" for hand in hands) > len(hands)
    lengths = _lengths(hands, hand_skeleton(joints))
    skeleton = hand_skeleton(joints, sides, lengths, left=left)
    check_poses(len(times), len(skeleton.names))
    positions = np.full((len(times), len(skeleton.names), 3), np.nan)
    confidence = np.zeros(positions.shape[:2])
    column = {name: index for index, name in enumerate(skeleton.names)}
    for side, track in tracks.items():
        for index, hand in enumerate(track):
            for name, place in hand.joints.items() if hand else ():
                joint = column[f"{side}_{name}" if side else name]
                positions[index, joint] = place
                confidence[index, joint] = hand.confidence if hand else 0.0
    positions = leap_to_world(positions)
    if sides:
        seen = confidence.max(axis=1)
        positions[seen > 0, column[ROOT]] = chest()
        confidence[:, column[ROOT]] = seen
    return Recording(
        skeleton=skeleton,
        times=times,
        positions=positions,
        rotations=None,
        confidence=confidence,
        performers=np.zeros(len(times), dtype=np.int64),
        arrivals=np.full(len(times), np.nan),
        notes=notes,
    )


def _lengths(hands: Sequence[Hand], one_hand: Skeleton) -> dict[str, float]:
    """Median length [m] of the bone that ends at each joint, over all hands and frames."""
    found: dict[str, float] = {}
    for name, parent in zip(one_hand.names, one_hand.parents, strict=True):
        above = one_hand.names[parent]
        both = [hand.joints for hand in hands if name in hand.joints and above in hand.joints]
        if parent >= 0 and both:
            ends = np.array([joints[name] - joints[above] for joints in both])
            found[name] = 1e-3 * float(np.median(np.linalg.norm(ends, axis=1)))
    return found
