"""Reads JSON of MediaPipe landmarks: results of its tasks, of TensorFlow.js, and many variants.

A document is a list of frames, an object with such a list or with frames by number, or one object
per line. A frame is an object with "pose_world_landmarks", "poseLandmarks", "keypoints3D",
"left_hand_landmarks" and others, in any spelling, or with landmarks by name, or a bare list
(`replay.mediapipe.json_points`).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from devices.bounded_json import check_json, parse_json
from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS, SIDES
from replay.mediapipe.json_points import HOLISTIC, number_of, people_in, points_in
from replay.mediapipe.moments import LandmarkText, Moment, Points, bounded
from replay.mediapipe.names import FRAMES, TIMES, hand_name, landmark_of, pose_name, snake
from replay.mediapipe.tables import clock

# Keys in small letters, without underscores.
_GROUPS = {
    "world": ("poseworldlandmarks", "worldlandmarks", "keypoints3d"),
    "image": ("poselandmarks", "landmarks", "keypoints", "pose", "body", "skeleton", "landmark"),
    "left": ("lefthandlandmarks", "lefthand"),
    "right": ("righthandlandmarks", "righthand"),
}
_HANDS = ("handlandmarks", "multihandlandmarks", "hands")
_HANDEDNESS = ("handedness", "handednesses", "multihandedness", "label", "side", "hand")
_PEOPLE = ("poses", "people", "persons", "bodies", "results")
_OF_FRAMES = {*(name for names in _GROUPS.values() for name in names), *_HANDS, *_PEOPLE}
_CERTAIN = {name for name in _OF_FRAMES if name.endswith(("landmarks", "keypoints", "3d"))}
_RATES = ("fps", "framerate", "framespersecond", "videofps")
_WIDTHS = ("width", "imagewidth", "framewidth", "videowidth")
_HEIGHTS = ("height", "imageheight", "frameheight", "videoheight")
_SIZES = ("imagesize", "size", "resolution", "framesize", "videosize", "dimensions")
_SHAPES = ("shape", "imageshape", "frameshape")  # as NumPy has them: height first
_ENOUGH = 8  # names of landmarks that make JSON a recording of them
_DEPTH = 3  # of objects around the list of frames
_KEY = re.compile(r'"([A-Za-z_0-9 ]{1,40})"\s*:')
_POINT = re.compile(r'\{\s*"x"\s*:\s*[-\d.eE+]+\s*,\s*"y"\s*:')
_ROWS = re.compile(r"\[\s*\[[-\d.eE+,\s]*\](?:\s*,\s*\[[-\d.eE+,\s]*\])*\s*\]")
_ROW = re.compile(r"\[[-\d.eE+,\s]+\]")
_COUNTS = (len(POSE_LANDMARKS), len(HAND_LANDMARKS), HOLISTIC)


def has_landmark_json(head: str) -> bool:
    """Whether some text begins JSON that names landmarks, or lists 33 or 21 of them at a time."""
    keys = set(_KEY.findall(head))
    if {_plain(key) for key in keys} & _CERTAIN:
        return True
    if sum(pose_name(key) is not None for key in keys) >= _ENOUGH:
        return True
    if (point := _POINT.search(head)) is not None:
        row = head[point.start() : head.find("]", point.end()) + 1 or len(head)]
        return len(_POINT.findall(row)) in _COUNTS
    rows, flat = _ROWS.search(head), _ROW.search(head)
    if rows is not None and rows[0].count("[") - 1 in _COUNTS:
        return True
    numbers = 0 if flat is None else flat[0].count(",") + 1
    return numbers in {width * count for width in (3, 4) for count in _COUNTS}


def read_document(text: str) -> LandmarkText:
    """Read JSON, also where it is cut off.

    Raises:
        InputError: it has too many frames.
        ValueError, TypeError, KeyError, RecursionError: it is damaged.
    """
    check_json(text)
    try:
        document = parse_json(text)
    except ValueError:
        document = list(_json_lines(text))
    found = LandmarkText([])
    if isinstance(document, dict):
        _describe(document, found)
    found.moments = _moments(document, found, _DEPTH)
    bounded(len(found.moments))
    return found


def _json_lines(text: str) -> Iterator[Any]:
    for line in text.splitlines():
        try:
            yield parse_json(line)
        except ValueError:
            continue  # a stopped recorder truncates its last line


def _plain(key: object) -> str:
    return snake(str(key)).replace("_", "")


def _fields(item: Mapping[str, Any]) -> dict[str, Any]:
    return {_plain(key): value for key, value in item.items()}


def _describe(fields: Mapping[str, Any], text: LandmarkText, depth: int = 2) -> None:
    """Take rate and image size from an object and the objects in it."""
    own = _fields(fields)
    if text.rate is None:
        text.rate = next((rate for n in _RATES if (rate := number_of(own.get(n))) > 0), None)
    if text.size is None:
        text.size = _size(own)
    for value in own.values():
        if depth and isinstance(value, dict):
            _describe(value, text, depth - 1)


def _size(own: Mapping[str, Any]) -> tuple[float, float] | None:
    width, height = (
        next((size for n in names if (size := number_of(own.get(n))) > 0), 0.0)
        for names in (_WIDTHS, _HEIGHTS)
    )
    if width and height:
        return width, height
    for names, across in ((_SIZES, 0), (_SHAPES, 1)):
        for name in names:
            value = own.get(name)
            if isinstance(value, str):
                value = re.findall(r"\d+", value)
            if isinstance(value, list) and 2 <= len(value) <= 3:
                pair = [number_of(value[across]), number_of(value[1 - across])]
                if min(pair) > 0:
                    return pair[0], pair[1]
    return None


def _moments(item: Any, text: LandmarkText, depth: int) -> list[Moment]:
    """The frames in a document: of its lists and objects the one that has most."""
    if isinstance(item, list):
        one = _moment(item, text)
        if one.people and not _are_frames(item):
            return [one]
        return [_moment(each, text) for each in item if isinstance(each, dict | list)]
    if not isinstance(item, dict):
        return []
    if item and all(str(key).isdecimal() for key in item):
        return [_moment(item, text)] if points_in(item, POSE_LANDMARKS) else _by_number(item, text)
    one = _moment(item, text)
    if one.people and not any(_are_frames(value) for value in item.values()):
        return [one]
    found = [_moments(value, text, depth - 1) for value in item.values() if depth > 0]
    best = max(found, key=lambda moments: sum(bool(m.people) for m in moments), default=[])
    return best if any(moment.people for moment in best) else [one]


def _are_frames(item: Any) -> bool:
    """Whether a value is a list of frames: of objects that name groups, or lists of landmarks."""
    if not isinstance(item, list) or not item:
        return False
    if isinstance(item[0], dict):
        named = bool(_fields(item[0]).keys() & _OF_FRAMES)
        return named or (len(item) > 1 and bool(points_in(item[0], POSE_LANDMARKS)))
    return len(item) > 1 and bool(people_in(item[0]))


def _by_number(item: Mapping[str, Any], text: LandmarkText) -> list[Moment]:
    moments = []
    for key in sorted(item, key=int):
        moment = _moment(item[key], text)
        moment.frame = float(int(key)) if moment.frame is None else moment.frame
        moments.append(moment)
    return moments


def _moment(item: Any, text: LandmarkText) -> Moment:
    """One frame, from an object or a bare list."""
    moment = Moment()
    if isinstance(item, dict):
        _stamp(moment, {snake(str(key)): value for key, value in item.items()}, text)
        fields = _fields(item)
        text.size = text.size or _size(fields)
        _add_fields(moment, fields, 0)
    if not moment.people:
        for person, points in enumerate(people_in(item)):
            _add(moment, points, "image", person)
    return moment


def _stamp(moment: Moment, fields: Mapping[str, Any], text: LandmarkText) -> None:
    """Take time and number of a frame."""
    for name, second in TIMES.items():
        value = fields.get(name)
        if isinstance(value, str) and (seconds := clock(value)) is not None:
            moment.time, text.second = seconds, 1.0
            break
        if math.isfinite(number := number_of(value)):
            moment.time, text.second = number, second
            break
    numbers = (number_of(fields.get(name)) for name in FRAMES)
    moment.frame = next((number for number in numbers if math.isfinite(number)), None)


def _add_fields(moment: Moment, fields: Mapping[str, Any], person: int) -> None:
    """Add the groups that an object names, and those of the people in it."""
    for group, names in _GROUPS.items():
        labels = HAND_LANDMARKS if group in SIDES else POSE_LANDMARKS
        for name in names:
            for number, points in enumerate(people_in(fields.get(name), labels)):
                _add(moment, points, group, person + number)
    for name in _HANDS:
        _add_hands(moment, fields.get(name), fields, person)
    for name in _PEOPLE:
        people = fields.get(name)
        for number, one in enumerate(people if isinstance(people, list) else []):
            if isinstance(one, dict):
                _add_fields(moment, _fields(one), person + number)
            else:
                for points in people_in(one)[:1]:
                    _add(moment, points, "image", person + number)


def _add_hands(moment: Moment, hands: Any, fields: Mapping[str, Any], person: int) -> None:
    """Add hands whose sides stand in or beside them; without a side the first is the right one."""
    beside: list[Any] = next((s for n in _HANDEDNESS if isinstance(s := fields.get(n), list)), [])
    for number, hand in enumerate(hands if isinstance(hands, list) else []):
        side = _side(beside[number]) if number < len(beside) else None
        if side is None and isinstance(hand, dict):
            own = _fields(hand)
            side = _side([own.get(name) for name in _HANDEDNESS])
        for points in people_in(hand, HAND_LANDMARKS)[:1]:
            _add(moment, points, side or SIDES[1 - number % 2], person)


def _side(handedness: Any) -> str | None:
    """The side that a handedness says: "Left", [{"categoryName": "Left"}], {"label": "Left"}."""
    words = re.findall(r"\b(left|right)\b", json.dumps(handedness).lower())
    return words[0] if words else None


def _add(moment: Moment, points: Points, group: str, person: int) -> None:
    """Add points under the names of their landmarks; hands that they name go to their own groups.

    Args:
        moment: to add to.
        points: by any names, or by number.
        group: that is meant by names of a pose, and by numbers.
        person: whose points they are.
    """
    for name, found in points.items():
        if group in SIDES:
            number = int(name) if name.isdecimal() else -1
            known = HAND_LANDMARKS[number] if 0 <= number < len(HAND_LANDMARKS) else hand_name(name)
            place = None if known is None else (group, known)
        else:
            place = landmark_of(name)
            if place is not None and place[0] == "image":
                place = group, place[1]
        if place is not None:
            moment.add(place[0], {place[1]: found}, person)
