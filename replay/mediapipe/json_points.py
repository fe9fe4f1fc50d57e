"""Landmarks of one person or several in a value of JSON: by name, by number, or in a row."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS
from replay.mediapipe.moments import Point, Points, point
from replay.mediapipe.names import SURE, landmark_of

HOLISTIC = 468 + len(POSE_LANDMARKS) + 2 * len(HAND_LANDMARKS)
"""Landmarks of a holistic model: face, left hand, pose, right hand."""

_FACE = 468
_FEWEST = 4  # landmarks that are a person
_PLACE = ("position", "pos", "coordinates", "point")


def people_in(item: Any, labels: Sequence[str] = POSE_LANDMARKS) -> list[Points]:
    """The landmarks of one person, or those of several, in a value."""
    points = points_in(item, labels)
    if points:
        return [points]
    if isinstance(item, dict):
        inner = next((item[n] for n in ("landmark", "landmarks", "keypoints") if n in item), None)
        return [] if inner is None else people_in(inner, labels)
    if not isinstance(item, list) or not 0 < len(item) < len(labels):
        return []
    return [points for each in item for points in [_first(each, labels)] if points]


def _first(item: Any, labels: Sequence[str]) -> Points:
    people = people_in(item, labels) if isinstance(item, list | dict) else []
    return people[0] if people else {}


def points_in(item: Any, labels: Sequence[str]) -> Points:
    """The landmarks of one person by name or number; {} where a value is something else."""
    if isinstance(item, dict):
        return _by_key(item)
    if not isinstance(item, list) or len(item) < _FEWEST:
        return {}
    if all(isinstance(value, int | float) for value in item):
        return _flat(item, labels)
    known: Points = {}
    for number, value in enumerate(item):
        found = _point(value)
        if found is None:
            return {}
        known[_own_name(value) or str(number)] = found
    if all(name.isdecimal() for name in known):
        return _by_length(known, labels)
    return known if sum(landmark_of(name) is not None for name in known) >= _FEWEST else {}


def _by_key(item: Mapping[str, Any]) -> Points:
    """Landmarks that are the values of an object, by name or number."""
    named = {str(key): value for key, value in item.items() if landmark_of(str(key)) is not None}
    found = {str(int(n)) if n.isdecimal() else n: _point(value) for n, value in named.items()}
    points = {name: place for name, place in found.items() if place is not None}
    return points if _FEWEST <= len(points) == len(found) else {}


def _own_name(value: Any) -> str | None:
    """The name or number that a landmark says of itself."""
    if not isinstance(value, dict):
        return None
    own = next(
        (value[key] for key in ("name", "landmark", "part", "id", "index") if key in value), None
    )
    if isinstance(own, int) and not isinstance(own, bool):
        return str(own)
    return own if isinstance(own, str) and own else None


def _by_length(known: Points, labels: Sequence[str]) -> Points:
    """Landmarks in a row: of a hand, a pose, or all that a holistic model finds."""
    if len(known) == len(labels) or len(known) in (len(POSE_LANDMARKS), len(HAND_LANDMARKS)):
        return known
    if len(known) > len(POSE_LANDMARKS) and len(known) != HOLISTIC:
        return {name: found for name, found in known.items() if int(name) < len(POSE_LANDMARKS)}
    if len(known) != HOLISTIC:
        return known if any(not name.isdecimal() for name in known) else {}
    hand = len(HAND_LANDMARKS)
    names = [f"left_hand_{n}" for n in range(hand)] + [str(n) for n in range(len(POSE_LANDMARKS))]
    names += [f"right_hand_{n}" for n in range(hand)]
    return {name: known[str(_FACE + place)] for place, name in enumerate(names)}


def _flat(values: Sequence[float], labels: Sequence[str]) -> Points:
    """Landmarks whose numbers follow one another."""
    for count in dict.fromkeys((len(labels), len(POSE_LANDMARKS), len(HAND_LANDMARKS))):
        width, left = divmod(len(values), count)
        if not left and 2 <= width <= 4:
            rows = [values[n * width : (n + 1) * width] for n in range(count)]
            return {str(n): point([float(v) for v in row]) for n, row in enumerate(rows)}
    return {}


def _point(item: Any) -> Point | None:
    """A point from an object or a list of numbers; None where a value is something else."""
    if item is None:
        return math.nan, math.nan, math.nan, 0.0
    if isinstance(item, dict):
        fields = {str(key).lower(): value for key, value in item.items()}
        inner = next((fields[name] for name in _PLACE if name in fields), None)
        if inner is not None and "x" not in fields:
            return _point(inner)
        if "x" not in fields or "y" not in fields:
            return None
        sure = next((fields[key] for key in SURE if key in fields), None)
        item = [fields["x"], fields["y"], fields.get("z"), sure]
    elif not isinstance(item, list) or not 2 <= len(item) <= 5 or isinstance(item[0], list | dict):
        return None
    return point([number_of(value) for value in item[:4]])


def number_of(value: Any) -> float:
    """A number, also where it is written as text; NaN for all else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return math.nan
    try:
        return float(value)
    except (ValueError, OverflowError):
        return math.nan
