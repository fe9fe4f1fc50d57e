"""Recognises and interprets MediaPipe landmarks in text: their space, unit and image size."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from replay.mediapipe.clock import frame_times
from replay.mediapipe.documents import has_landmark_json, read_document
from replay.mediapipe.landmarks import PersonLandmarks, track
from replay.mediapipe.moments import GROUPS, LandmarkText, Moment, Point, name_numbers
from replay.mediapipe.space import in_landmark_axes
from replay.mediapipe.tables import has_landmark_table, read_table
from replay.stated import Stated
from replay.text_file import decoded

Array = NDArray[np.float64]
Tracks = dict[str, Array]

USUAL_ASPECT = 16.0 / 9.0
WORLD_CENTRE = 0.05  # [m] largest distance of the hips' middle from the origin of world landmarks
_OPENING = ("{", "[")
_UNSEEN: Point = (math.nan, math.nan, math.nan, 0.0)


def has_landmark_text(head: bytes) -> bool:
    """Whether some bytes begin a table or JSON that names MediaPipe's landmarks."""
    text = decoded(head).lstrip("\ufeff \t\n")
    return has_landmark_json(text) if text[:1] in _OPENING else has_landmark_table(text)


def parse_landmark_text(data: bytes, stated: Stated) -> tuple[list[PersonLandmarks], list[str]]:
    """Return the people in a table or JSON, and notes on the assumptions made.

    Raises:
        InputError: the text names no landmark of MediaPipe's.
    """
    characters = decoded(data).lstrip("\ufeff \t\n")
    try:
        read = read_document if characters[:1] in _OPENING else read_table
        text = read(characters)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError, csv.Error) as error:
        raise InputError(f"its text is damaged ({type(error).__name__})") from error
    name_numbers(text)
    if not any(moment.people for moment in text.moments):
        raise InputError("it names no landmark of MediaPipe's")
    times = frame_times(text)
    people = [_person(text, number, times, stated) for number in _people(text.moments)]
    return people, list(dict.fromkeys(text.notes))


def _people(moments: Sequence[Moment]) -> list[int]:
    return sorted({person for moment in moments for person in moment.people})


def _person(text: LandmarkText, number: int, times: Array, stated: Stated) -> PersonLandmarks:
    alone = len(_people(text.moments)) == 1
    there = np.array([alone or number in moment.people for moment in text.moments])
    moments = [moment for moment, here in zip(text.moments, there, strict=True) if here]
    groups = {group: _tracks(moments, number, group) for group in GROUPS}
    world, image = groups["world"], groups["image"]
    in_room = False
    if not world and (turned := in_landmark_axes(image, stated, text.notes)) is not None:
        world, image, in_room = turned, {}, True
    elif not world and _in_metres(image):
        world, image = image, {}
        text.notes.append("landmarks are assumed to be world landmarks: the hips are at the origin")
    in_image = [image, groups["left"], groups["right"]]
    if any(in_image) and _normalised(in_image):
        in_image = [_stretched(tracks, text.size) for tracks in in_image]
        if not world and text.size is None:
            text.notes.append(
                "the image's shape is not given; 16:9 is assumed (width and height in the file "
                "say otherwise)"
            )
    image, left, right = in_image
    hands = {"left": left, "right": right}
    return PersonLandmarks(times[there], number, world, image, hands, in_room)


def _tracks(moments: Sequence[Moment], person: int, group: str) -> Tracks:
    frames = [moment.people.get(person, {}).get(group, {}) for moment in moments]
    names = dict.fromkeys(name for points in frames for name in points)
    found = {}
    for name in names:
        rows = np.array([points.get(name, _UNSEEN) for points in frames])
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


def _stretched(tracks: Mapping[str, Array], size: tuple[float, float] | None) -> Tracks:
    aspect = USUAL_ASPECT if size is None else size[0] / size[1]
    factors = np.array([aspect, 1.0, aspect, 1.0])
    return {name: found * factors for name, found in tracks.items()}
