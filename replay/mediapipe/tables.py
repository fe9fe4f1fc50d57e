"""Read tables of MediaPipe landmarks: one row for each frame, or for each landmark.

Rows of frames have columns such as left_wrist_x, x15, lm15_x or right_hand_WRIST_x, counted from 0
or 1. Rows of landmarks have columns such as frame, time, landmark, x, y, z, visibility. Fields are
parted by commas, semicolons (then with decimal commas, perhaps) or tabs.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from datetime import datetime

from devices.mediapipe.joints import SIDES
from replay.mediapipe.moments import LandmarkText, Moment, Points, bounded, point
from replay.mediapipe.names import FRAMES, PEOPLE, SURE, TIMES, column_of, landmark_of, snake

_SURELY = tuple(
    "landmark landmark_name landmark_id landmark_index landmark_idx landmark_no keypoint "
    "keypoint_id keypoint_name lm_id lm".split()
)
_PERHAPS = ("id", "index", "idx", "joint", "joint_id", "joint_name", "point", "name", "part")
_KINDS = ("model", "type", "handedness", "hand_handness", "hand", "side", "group")
_WIDTHS, _HEIGHTS = (
    ("width", "image_width", "frame_width"),
    ("height", "image_height", "frame_height"),
)
_RATES = ("fps", "frame_rate", "framerate")
_AXES = {
    "world": ("{}_world_m", "{}_world", "world_{}", "{}_m"),
    "image": ("{}", "{}_img_px", "{}_px", "{}_image", "{}_img", "{}_norm", "image_{}"),
}
_ENOUGH = 8  # landmarks in a row for a table of frames
_CLOCK = re.compile(r"^(?:(\d+):)?(\d{1,2}):(\d{1,2}(?:[.,]\d+)?)$")


def has_landmark_table(head: str) -> bool:
    """Whether some text begins a table of landmarks."""
    lines = head.splitlines()[:400]
    if not lines:
        return False
    rows = csv.reader(lines, delimiter=delimiter(lines[0]))
    try:
        header = [snake(cell) for cell in next(rows, [])]
        places = [place for cell in header if (place := column_of(cell))]
        if len({place[:2] for place in places if place[2] == "y"}) >= _ENOUGH:
            return True
        column = _landmark_column(header)
        if column is None or not _long_axes(header):
            return False
        named = [landmark_of(row[column]) for row in rows if len(row) > column]
    except (csv.Error, ValueError):
        return False
    known = {found for found in named if found is not None}
    if header[column] in _SURELY:
        return bool(named) and named[0] is not None
    return len(known) >= _ENOUGH and None not in named


def delimiter(line: str) -> str:
    """The delimiter of the fields in a table's first line."""
    return max(",;\t|", key=line.count)


def read_table(text: str) -> LandmarkText:
    """Read a table.

    Raises:
        InputError: it has too many frames.
        csv.Error, ValueError: it is damaged.
    """
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter(text.partition("\n")[0]))
    header = [snake(cell) for cell in next(rows, [])]
    table = _Table(header)
    column = _landmark_column(header)
    if column is not None and _long_axes(header):
        return table.of_landmarks(rows, column)
    return table.of_frames(rows)


def _landmark_column(header: Sequence[str]) -> int | None:
    return next((header.index(name) for name in (*_SURELY, *_PERHAPS) if name in header), None)


def _long_axes(header: Sequence[str]) -> dict[str, list[int | None]]:
    """Columns of x, y, z of each group in a table with one row per landmark."""
    found: dict[str, list[int | None]] = {}
    for group, patterns in _AXES.items():
        for pattern in patterns:
            names = [pattern.format(axis) for axis in "xyz"]
            if pattern == "{}_img_px" and "z_img" in header:
                names[2] = "z_img"
            if all(name in header for name in names[:2]):
                columns = [header.index(name) if name in header else None for name in names]
                found.setdefault(group, columns)
    return found


class _Table:
    """The columns of a table that are no landmark's."""

    def __init__(self, header: Sequence[str]) -> None:
        self._header = header
        self._time = self._first(tuple(TIMES))
        self._frame, self._person = self._first(FRAMES), self._first(PEOPLE)
        self._people: dict[str, int] = {}
        named = None if self._time is None else TIMES[header[self._time]]
        self._text = LandmarkText([], second=named)

    def _first(self, names: Sequence[str]) -> int | None:
        return next((self._header.index(name) for name in names if name in self._header), None)

    def _moment(self, row: Sequence[str]) -> Moment:
        if self._text.size is None:
            width, height = (_cell(row, self._first(names)) for names in (_WIDTHS, _HEIGHTS))
            if width > 0 and height > 0:
                self._text.size = width, height
        rate = _cell(row, self._first(_RATES))
        if self._text.rate is None and rate > 0:
            self._text.rate = rate
        time, frame = self._seconds(row), _cell(row, self._frame)
        return Moment(time, frame if math.isfinite(frame) else None)

    def _seconds(self, row: Sequence[str]) -> float | None:
        if self._time is None or self._time >= len(row):
            return None
        value = clock(row[self._time])
        if value is not None:
            self._text.second = 1.0
            return value
        value = _cell(row, self._time)
        return value if math.isfinite(value) else None

    def _who(self, row: Sequence[str]) -> int:
        if self._person is None or self._person >= len(row):
            return 0
        return self._people.setdefault(row[self._person], len(self._people))

    def of_frames(self, rows: Iterator[list[str]]) -> LandmarkText:
        """One row for each frame, or for each person of a frame."""
        columns: dict[tuple[str, str], dict[str, int]] = {}
        for place, cell in enumerate(self._header):
            if (found := column_of(cell)) is not None:
                group, name, axis = found
                columns.setdefault((group, name), {}).setdefault(axis, place)
        columns = {place: axes for place, axes in columns.items() if {"x", "y"} <= axes.keys()}
        kind = self._first(_KINDS)
        for row in rows:
            moment = self._moment(row)
            last = self._text.moments[-1] if self._text.moments else None
            who = self._who(row)
            if last is not None and who not in last.people and _same(last, moment):
                moment = last
            else:
                self._text.moments.append(moment)
                bounded(len(self._text.moments))
            groups: dict[str, Points] = {}
            for (group, name), axes in columns.items():
                values = [_cell(row, axes.get(axis)) for axis in "xyzv"]
                own = _side(row, kind) or group if group in SIDES else group
                groups.setdefault(own, {})[name] = point(values)
            moment.people[who] = groups
        return self._text

    def of_landmarks(self, rows: Iterator[list[str]], column: int) -> LandmarkText:
        """One row for each landmark of a frame."""
        axes, kind = _long_axes(self._header), self._first(_KINDS)
        sure = self._first(SURE)
        key = self._frame if self._frame is not None else self._time
        moments: dict[str, Moment] = {}
        for row in rows:
            found = landmark_of(_long_name(row, column, kind)) if len(row) > column else None
            if found is None:
                continue
            which = row[key] if key is not None and key < len(row) else ""
            if which not in moments:
                moments[which] = self._moment(row)
                bounded(len(moments))
            for space, columns in axes.items():
                group = space if found[0] == "image" else found[0]
                values = [_cell(row, one) for one in [*columns, sure]]
                moments[which].add(group, {found[1]: point(values)}, self._who(row))
        self._text.moments = list(moments.values())
        return self._text


def _long_name(row: Sequence[str], column: int, kind: int | None) -> str:
    """The landmark of a row; its group may stand in another column: left_hand, mediapipe.face."""
    name, side = row[column], _side(row, kind)
    if kind is not None and kind < len(row) and "face" in snake(row[kind]).split("_"):
        return ""
    return name if side is None or snake(name).startswith(side) else f"{side}_hand_{name}"


def _side(row: Sequence[str], kind: int | None) -> str | None:
    """The side that a column says: "Left", "mediapipe.left_hand"; None if it says none."""
    words = snake(row[kind]).split("_") if kind is not None and kind < len(row) else []
    return next((side for side in SIDES if side in words), None)


def _same(one: Moment, other: Moment) -> bool:
    """Whether two rows are people of one frame."""
    if one.frame is not None or other.frame is not None:
        return one.frame == other.frame
    return one.time is not None and one.time == other.time


def clock(text: str) -> float | None:
    """The seconds of a time of day or a date, as 0:00:01.033 or 2024-05-01T10:00:00.033."""
    if (found := _CLOCK.match(text.strip())) is not None:
        hours, minutes, seconds = found.groups()
        return 3600.0 * float(hours or 0) + 60.0 * float(minutes) + float(seconds.replace(",", "."))
    if "-" not in text[1:] or ":" not in text:
        return None
    try:
        return (
            datetime.fromisoformat(text.strip()).replace(tzinfo=None) - datetime(1970, 1, 1)
        ).total_seconds()
    except ValueError:
        return None


def _cell(row: Sequence[str], column: int | None) -> float:
    if column is None or column >= len(row):
        return math.nan
    try:
        return float(row[column].replace(",", "."))
    except ValueError:
        return math.nan
