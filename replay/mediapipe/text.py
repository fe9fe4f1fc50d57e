"""Parse MediaPipe landmarks in text files: CSV tables and JSON in several common layouts.

Tables: one row per landmark (columns such as frame, time, landmark, x, y, z, visibility), or one
row per frame (columns such as left_wrist_x or x15). JSON: one object per line or a list of them,
each with "pose_world_landmarks", "pose_landmarks", "left_hand_landmarks", "right_hand_landmarks"
(all optional, camelCase too; of several people the first is read), each landmark
{x, y, z, visibility} or a list of those numbers.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS, SIDES
from replay.mediapipe.landmarks import PersonLandmarks, track

Array = NDArray[np.float64]
Point = tuple[float, float, float, float]  # x, y, z, confidence

MAX_FRAMES = 1_000_000
USUAL_RATE = 30.0
USUAL_ASPECT = 16.0 / 9.0
WORLD_CENTRE = 0.05  # [m] largest distance of the hips' middle from the origin of world landmarks

_TIMES = {"t": 1.0, "t_s": 1.0, "time": 1.0, "time_s": 1.0, "seconds": 1.0, "timestamp": 1.0}
_TIMES |= {"timestamp_s": 1.0, "t_ms": 1e-3, "time_ms": 1e-3, "timestamp_ms": 1e-3}
_TIMES |= {"timestampms": 1e-3, "timestamp_us": 1e-6, "milliseconds": 1e-3}
_FRAMES = ("frame", "frame_id", "frame_number", "frame_index", "frame_idx", "frame_no")
_NAMES = ("landmark", "landmark_name", "landmark_id", "landmark_index", "landmark_idx")
_SURE = ("visibility", "confidence", "presence", "score", "v", "c")
_AXES = {
    "world": ("{}_world_m", "{}_world", "world_{}", "{}_m"),
    "image": ("{}", "{}_img_px", "{}_px", "{}_image", "{}_img", "{}_norm", "image_{}"),
}
_WIDE = (
    re.compile(r"^(?P<axis>[xyzvc])_?(?P<name>\d{1,2})$"),
    re.compile(r"^(?:pose_|landmark_|lm_?)?(?P<name>[a-z_]+?|\d{1,2})_(?P<axis>[xyzvc])$"),
    re.compile(r"^(?:pose_|landmark_|lm_?)?(?P<name>[a-z_]+?|\d{1,2})_(?P<axis>v)isibility$"),
)
_GROUPS = {
    "world": ("pose_world_landmarks", "poseworldlandmarks", "world_landmarks", "worldlandmarks"),
    "image": ("pose_landmarks", "poselandmarks", "landmarks"),
    "left": ("left_hand_landmarks", "lefthandlandmarks"),
    "right": ("right_hand_landmarks", "righthandlandmarks"),
}


@dataclass(slots=True)
class _Moment:
    """The landmarks of one frame by group (world, image, left, right) and name."""

    time: float | None = None
    groups: dict[str, dict[str, Point]] = field(default_factory=dict)


def has_landmark_text(head: bytes) -> bool:
    """Whether some bytes begin a table or JSON that names MediaPipe's landmarks."""
    lines = head.decode("utf-8-sig", errors="ignore").lstrip().lower().splitlines()
    if not lines:
        return False
    if lines[0][:1] in ("{", "["):
        text = " ".join(lines[:50])
        return any(f'"{name}"' in text for names in _GROUPS.values() for name in names)
    header = _cells(lines[0])
    if len(_wide(header)) >= 3 * 8:
        return True
    column = next((header.index(name) for name in _NAMES if name in header), None)
    if column is None or len(lines) < 2 or not _long_axes(header):
        return False
    first = _cells(lines[1])
    return len(first) > column and _pose_name(first[column]) is not None


def parse_landmark_text(data: bytes) -> tuple[list[PersonLandmarks], list[str]]:
    """Return the people (one) in a table or JSON, and notes on the assumptions made.

    Raises:
        InputError: the text names no landmark of MediaPipe's.
    """
    text = data.decode("utf-8-sig", errors="replace").lstrip()
    try:
        moments = _json_moments(text) if text[:1] in ("{", "[") else _table_moments(text)
    except (ValueError, TypeError, KeyError, RecursionError, csv.Error) as error:
        raise InputError(f"its text is damaged ({type(error).__name__})") from error
    if not any(moment.groups for moment in moments):
        raise InputError("it names no landmark of MediaPipe's")
    notes: list[str] = []
    times = _moment_times(moments, notes)
    groups = {group: _tracks(moments, group) for group in _GROUPS}
    world, image = groups["world"], groups["image"]
    if not world and _in_metres(image):
        world, image = image, {}
        notes.append("landmarks are assumed to be world landmarks: the hips are at the origin")
    in_image = [image, groups["left"], groups["right"]]
    if any(in_image) and _normalised(in_image):
        in_image = [_stretched(tracks) for tracks in in_image]
        if not world:
            notes.append("the image's shape is not given; 16:9 is assumed")
    image, left, right = in_image
    return [PersonLandmarks(times, 0, world, image, {"left": left, "right": right})], notes


# -- tables ---------------------------------------------------------------------------------------


def _cells(line: str) -> list[str]:
    return [cell.strip().strip('"').lower() for cell in line.split(",")]


def _pose_name(text: str) -> str | None:
    text = text.strip().lower()
    if text.isascii() and text.isdigit():
        return POSE_LANDMARKS[int(text)] if int(text) < len(POSE_LANDMARKS) else None
    return text if text in POSE_LANDMARKS else None


def _long_axes(header: Sequence[str]) -> dict[str, list[int]]:
    """Columns of x, y, z of each group in a table with one row per landmark."""
    found: dict[str, list[int]] = {}
    for group, patterns in _AXES.items():
        for pattern in patterns:
            names = [pattern.format(axis) for axis in "xyz"]
            if pattern == "{}_img_px" and "z_img" in header:
                names[2] = "z_img"
            if all(name in header for name in names):
                found.setdefault(group, [header.index(name) for name in names])
    return found


def _wide(header: Sequence[str]) -> dict[tuple[str, str], int]:
    """Column by landmark and axis (x, y, z, v) in a table with one row per frame."""
    found: dict[tuple[str, str], int] = {}
    for column, cell in enumerate(header):
        matches = (pattern.match(cell) for pattern in _WIDE)
        match = next((match for match in matches if match), None)
        name = _pose_name(match["name"]) if match else None
        if match and name:
            found[name, "v" if match["axis"] == "c" else match["axis"]] = column
    return found


def _table_moments(text: str) -> list[_Moment]:
    rows = csv.reader(io.StringIO(text, newline=""))
    header = [cell.strip().lower() for cell in next(rows, [])]
    time = next(((header.index(name), s) for name, s in _TIMES.items() if name in header), None)
    axes, wide = _long_axes(header), _wide(header)
    column = next((header.index(name) for name in _NAMES if name in header), None)
    if column is not None and axes:
        return list(_long_moments(rows, header, column, axes, time))
    moments = []
    for row in rows:
        points = {
            name: _point([_cell(row, wide.get((name, axis))) for axis in "xyzv"])
            for name in dict.fromkeys(name for name, _ in wide)
        }
        moments.append(_Moment(_time(row, time), {"image": points}))
        _bound(moments)
    return moments


def _long_moments(
    rows: Iterator[list[str]],
    header: Sequence[str],
    column: int,
    axes: Mapping[str, list[int]],
    time: tuple[int, float] | None,
) -> list[_Moment]:
    frame = next((header.index(name) for name in _FRAMES if name in header), None)
    key = frame if frame is not None else time[0] if time else None
    sure = next((header.index(name) for name in _SURE if name in header), None)
    moments: dict[str, _Moment] = {}
    for row in rows:
        name = _pose_name(row[column]) if len(row) > column else None
        if name is None:
            continue
        which = row[key] if key is not None and key < len(row) else ""
        moment = moments.setdefault(which, _Moment(_time(row, time)))
        for group, columns in axes.items():
            values = [_cell(row, one) for one in [*columns, sure]]
            moment.groups.setdefault(group, {})[name] = _point(values)
        _bound(moments)
    return list(moments.values())


def _time(row: Sequence[str], time: tuple[int, float] | None) -> float | None:
    value = _cell(row, time[0]) if time else math.nan
    return value * time[1] if time and math.isfinite(value) else None


def _cell(row: Sequence[str], column: int | None) -> float:
    try:
        return float(row[column]) if column is not None and column < len(row) else math.nan
    except ValueError:
        return math.nan


def _point(values: Sequence[float]) -> Point:
    x, y, z, sure = (*values, math.nan, math.nan)[:4]
    return x, y, 0.0 if math.isnan(z) else z, 1.0 if math.isnan(sure) else sure


def _bound(found: Sequence[_Moment] | Mapping[str, _Moment]) -> None:
    if len(found) > MAX_FRAMES:
        raise InputError(f"it holds more than {MAX_FRAMES} frames")


# -- JSON -----------------------------------------------------------------------------------------


def _json_moments(text: str) -> list[_Moment]:
    try:
        document = json.loads(text)
    except ValueError:
        document = list(_json_lines(text))
    if isinstance(document, dict):
        document = document.get("frames", [document])
    moments = [_json_moment(item) for item in document if isinstance(item, dict)]
    _bound(moments)
    return moments


def _json_lines(text: str) -> Iterator[Any]:
    for line in text.splitlines():
        try:
            yield json.loads(line)
        except ValueError:
            continue  # a stopped recorder truncates its last line


def _json_moment(item: Mapping[str, Any]) -> _Moment:
    fields = {str(key).lower(): value for key, value in item.items()}
    moment = _Moment()
    for name, scale in _TIMES.items():
        if isinstance(value := fields.get(name), int | float) and math.isfinite(value):
            moment.time = float(value) * scale
            break
    for group, names in _GROUPS.items():
        found = next((fields[name] for name in names if fields.get(name)), None)
        labels = HAND_LANDMARKS if group in SIDES else POSE_LANDMARKS
        if points := _json_points(found, labels):
            moment.groups[group] = points
    return moment


def _json_points(found: Any, labels: Sequence[str]) -> dict[str, Point]:
    """Landmarks from a list of them, or from a list of people's lists."""
    if isinstance(found, dict):
        found = found.get("landmark", found.get("landmarks"))
    while isinstance(found, list) and len(found) and len(found) < len(labels):
        found = found[0]
    if not isinstance(found, list) or len(found) != len(labels):
        return {}
    return {label: _json_point(item) for label, item in zip(labels, found, strict=True)}


def _json_point(item: Any) -> Point:
    if isinstance(item, dict):
        item = [item.get(key) for key in ("x", "y", "z")] + [
            next((item[key] for key in _SURE if key in item), None)
        ]
    if not isinstance(item, list):
        return _point([])
    return _point([float(v) if isinstance(v, int | float) else math.nan for v in item[:4]])


# -- from moments to tracks ----------------------------------------------------------------------


def _moment_times(moments: Sequence[_Moment], notes: list[str]) -> Array:
    known = [moment.time for moment in moments]
    if any(time is None for time in known):
        notes.append(f"times are missing; {USUAL_RATE:.0f} frames a second are assumed")
        return np.arange(len(moments)) / USUAL_RATE
    times = np.array(known, dtype=np.float64)
    if (np.diff(times) < 0).any():
        notes.append("times go back; those frames get the time before")
    return np.maximum.accumulate(times)


def _tracks(moments: Sequence[_Moment], group: str) -> dict[str, Array]:
    names = dict.fromkeys(name for m in moments for name in m.groups.get(group, {}))
    unseen: Point = (math.nan, math.nan, math.nan, 0.0)
    found = {}
    for name in names:
        rows = np.array([m.groups.get(group, {}).get(name, unseen) for m in moments])
        found[name] = track(rows[:, :3], rows[:, 3])
    return found


def _in_metres(tracks: Mapping[str, Array]) -> bool:
    hips = [tracks[name] for name in ("left_hip", "right_hip") if name in tracks]
    if len(hips) < 2:
        return False
    middle = 0.5 * (hips[0] + hips[1])[:, :2]
    middle = middle[np.isfinite(middle[:, 0])]
    return len(middle) > 0 and bool(np.abs(np.median(middle, axis=0)).max() < WORLD_CENTRE)


def _normalised(groups: Sequence[Mapping[str, Array]]) -> bool:
    """Whether most landmarks lie within an image whose sides are 1."""
    values = np.concatenate([c[:, :2].ravel() for tracks in groups for c in tracks.values()])
    values = np.abs(values[np.isfinite(values)])
    return len(values) > 0 and float(np.median(values)) < 2.0


def _stretched(tracks: Mapping[str, Array]) -> dict[str, Array]:
    factors = np.array([USUAL_ASPECT, 1.0, USUAL_ASPECT, 1.0])
    return {name: found * factors for name, found in tracks.items()}
