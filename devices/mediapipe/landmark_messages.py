"""Decode MediaPipe landmarks from JSON, one message per frame.

`docs/devices-cameras.md` describes the format. The lists have the names of MediaPipe's own results.
World landmarks have their origin between the hips and so lose the place of the body. If the image
landmarks and the image size come with them, the place follows from the camera's view, so walking
and jumping are kept. The first place is the origin then.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from devices.blend_shapes import Blends, checked_blends
from devices.bodies.camera_position import camera_position
from devices.bodies.performer_numbers import PerformerNumbers
from devices.mediapipe.joints import (
    HAND_LANDMARKS,
    MIDDLES,
    PARENTS,
    POSE_LANDMARKS,
    SIDES,
    landmark_skeleton,
    landmarks_to_world,
)
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.clock_map import ClockMap
from devices.transport.json_object import json_object

Array = NDArray[np.float64]
# Landmarks are (N, 4): x, y, z and confidence in [0, 1]; NaN, NaN, NaN, 0 where one is missing.

MOST_BYTES = 65536
MOST_PEOPLE = 16
FURTHEST = 100.0  # [m], or widths of the image
USUAL_VIEW = 60.0  # [degrees] horizontal field of view of a webcam
MOST_PIXELS = 1e5
_FINGERTIPS = {f"{side}_{finger}" for side in SIDES for finger in ("thumb", "index", "pinky")}
_HANDS = {f"{side}_{name}" for side in SIDES for name in HAND_LANDMARKS[1:]}
_POSE_ROW = {name: row for row, name in enumerate(POSE_LANDMARKS)}


class Clock(Protocol):
    """Maps a sender's times to the host's monotonic clock."""

    def host_time(self, device: float, arrival: float) -> float:
        """Return the host time [s] of a sender's time [s] that was received at `arrival` [s]."""
        ...


class LandmarkDecoder:
    """Frames of all people in a message.

    Args:
        hands: whether the skeleton has MediaPipe's hands, 21 points each, instead of the three
            fingertips of its pose.
        view: horizontal field of view of the camera [degrees].
        clock: maps the sender's times to the host's; by the smallest recent delay if None.

    Attributes:
        refused: messages, or people in them, that could not be decoded.
    """

    def __init__(
        self, *, hands: bool = False, view: float = USUAL_VIEW, clock: Clock | None = None
    ) -> None:
        self.refused = 0
        self._skeleton = landmark_skeleton(set(PARENTS) - (_FINGERTIPS if hands else _HANDS))
        self._columns = {name: column for column, name in enumerate(self._skeleton.names)}
        self._focal = 0.5 / math.tan(math.radians(0.5 * view))  # in widths of the image
        self._clock: Clock = clock or ClockMap()
        self._numbers = PerformerNumbers()
        self._origin: Array | None = None
        self._places: dict[int, Array] = {}
        self._faces: dict[int, Blends] = {}

    @property
    def skeleton(self) -> Skeleton:
        """MediaPipe's joints, with added middles of the hips and of the shoulders."""
        return self._skeleton

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return a frame of each person in the message `data`, received at `arrival` [s]."""
        message = json_object(data, MOST_BYTES)
        people = _people(message.get("pose_world_landmarks"), len(POSE_LANDMARKS))
        if people is None:
            self.refused += 1
            return []
        self.refused += sum(person is None for person in people)
        stamp = _number(message.get("timestamp_ms"))
        time = self._clock.host_time(arrival if stamp is None else stamp * 1e-3, arrival)
        ids = _ids(message.get("ids"), len(people))
        bodies = {
            ids[row]: (person, self._extras(message, row))
            for row, person in enumerate(people)
            if person is not None
        }
        places = {body: self._place(*bodies[body], message, body) for body in bodies}
        numbers = self._numbers(places)
        self._watch_faces(message, ids)
        return [
            replace(
                _frame(self._joints(person, extras), places[body], numbers[body], (time, arrival)),
                blends=self._faces.get(body),
            )
            for body, (person, extras) in bodies.items()
        ]

    def _watch_faces(self, message: Mapping[str, Any], ids: Sequence[int]) -> None:
        """Remember the blend shapes of each face; one that is not seen keeps its last ones."""
        faces = _faces(message.get("face_blendshapes"))
        for body, face in zip(ids, faces, strict=False):
            if face is not None:
                if body not in self._faces and len(self._faces) >= MOST_PEOPLE:
                    self._faces.clear()
                self._faces[body] = face

    def _extras(self, message: Mapping[str, Any], row: int) -> dict[str, Array]:
        """The optional landmarks of the person in `row`: image and hands."""
        found = {}
        for name, count in (
            ("pose_landmarks", len(POSE_LANDMARKS)),
            *((f"{side}_hand_world_landmarks", len(HAND_LANDMARKS)) for side in SIDES),
        ):
            people = _people(message.get(name), count) or []
            if row < len(people) and (landmarks := people[row]) is not None:
                found[name] = landmarks
        return found

    def _place(
        self, world: Array, extras: Mapping[str, Array], message: Mapping[str, Any], body: int
    ) -> Array:
        """Position (3,) [m, MediaPipe's axes] of the hips relative to where hips were first seen.

        Without image landmarks the body keeps its place.
        """
        size, image = _size(message.get("image_size")), extras.get("pose_landmarks")
        if size is not None and image is not None:
            picture = (image[:, :2] - 0.5) * size
            weights = np.minimum(world[:, 3], image[:, 3])
            seen = camera_position(world[:, :3], picture, weights, self._focal * size[0])
            if seen is not None:
                self._origin = seen if self._origin is None else self._origin
                if body not in self._places and len(self._places) >= MOST_PEOPLE:
                    self._places.clear()
                self._places[body] = seen - self._origin
        return self._places.get(body, np.zeros(3))

    def _joints(self, world: Array, extras: Mapping[str, Array]) -> Array:
        """The skeleton's joints (J, 4), relative to the middle of the hips."""
        table = np.full((len(self._columns), 4), (np.nan, np.nan, np.nan, 0.0))
        for name, row in _POSE_ROW.items():
            if name in self._columns:
                table[self._columns[name]] = world[row]
        for middle, (left, right) in MIDDLES.items():
            ends = table[[self._columns[left], self._columns[right]]]
            table[self._columns[middle]] = [*ends[:, :3].mean(axis=0), ends[:, 3].min()]
        for side in SIDES:
            hand = extras.get(f"{side}_hand_world_landmarks")
            if hand is not None and f"{side}_{HAND_LANDMARKS[1]}" in self._columns:
                self._add_hand(table, side, hand)
        return table

    def _add_hand(self, table: Array, side: str, hand: Array) -> None:
        """Add a hand's landmarks [m], whose origin lies in the hand, at the body's wrist."""
        wrist = table[self._columns[f"{side}_wrist"]]
        for row, name in enumerate(HAND_LANDMARKS[1:], 1):
            place = wrist[:3] + hand[row, :3] - hand[0, :3]
            # MediaPipe gives hand points no visibility; points of a detected hand count as seen.
            table[self._columns[f"{side}_{name}"]] = [*place, wrist[3]]


def _frame(joints: Array, place: Array, number: int, times: tuple[float, float]) -> SkeletonFrame:
    """Frame of joints (J, 4) relative to hips at `place`; `times` are its time and arrival [s]."""
    seen = (joints[:, 3] > 0.0) & np.isfinite(joints).all(axis=1)
    return SkeletonFrame(
        time=times[0],
        positions=landmarks_to_world(np.where(seen[:, None], joints[:, :3] + place, np.nan)),
        rotations=None,
        confidence=np.where(seen, joints[:, 3], 0.0),
        performer=number,
        arrival=times[1],
    )


def _faces(value: Any) -> list[Blends | None]:
    """The blend shapes of each face: lists of MediaPipe's categories, or objects by name.

    A single face, as MediaPipe's holistic model gives it, becomes a list of one.
    """
    if isinstance(value, dict) or (
        isinstance(value, list) and value and isinstance(value[0], dict) and "score" in value[0]
    ):
        value = [value]
    return [_face(face) for face in value[:MOST_PEOPLE]] if isinstance(value, list) else []


def _face(face: Any) -> Blends | None:
    pairs: list[tuple[Any, Any]] = []
    if isinstance(face, dict):
        pairs = list(face.items())
    elif isinstance(face, list):
        shapes = [shape for shape in face if isinstance(shape, dict)]
        pairs = [
            (shape.get("category_name", shape.get("categoryName")), shape.get("score"))
            for shape in shapes
        ]
    return checked_blends(pair for pair in pairs if pair[0] != "_neutral")


def _people(value: Any, count: int) -> list[Array | None] | None:
    """Landmarks (count, 4) of each person, None for an invalid one; None if `value` is no list.

    A single person's landmarks, as MediaPipe's holistic model gives them, become a list of one.
    """
    if not isinstance(value, list) or len(value) > max(MOST_PEOPLE, count):
        return None
    if value and (isinstance(value[0], dict) or _is_landmark(value[0])):
        value = [value]
    return [_landmarks(person, count) for person in value[:MOST_PEOPLE]]


def _is_landmark(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and _number(value[0]) is not None


def _landmarks(value: Any, count: int) -> Array | None:
    if not isinstance(value, list) or len(value) != count:
        return None
    return np.array([_landmark(landmark) for landmark in value])


def _landmark(value: Any) -> tuple[float, float, float, float]:
    """x, y, z and visibility of [x, y, z], [x, y, z, visibility ...] or {"x": ...}; visibility is 1
    if it is missing."""
    if isinstance(value, dict):
        value = [value.get(key) for key in ("x", "y", "z", "visibility")]
        value = value[:3] if value[3] is None else value
    numbers = [_number(item) for item in value[:4]] if isinstance(value, list) else []
    x, y, z, visibility = (*numbers, 1.0)[:4] if len(numbers) >= 3 else (None,) * 4
    if x is None or y is None or z is None or visibility is None:
        return (math.nan, math.nan, math.nan, 0.0)
    if max(abs(x), abs(y), abs(z)) > FURTHEST:
        return (math.nan, math.nan, math.nan, 0.0)
    return (x, y, z, min(max(visibility, 0.0), 1.0))


def _number(value: Any) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) < 1e15:
        return None
    return float(value)


def _size(value: Any) -> tuple[float, float] | None:
    """Width and height [pixels] of the image, or None."""
    if not isinstance(value, list) or len(value) != 2:
        return None
    width, height = _number(value[0]), _number(value[1])
    if width is None or height is None or not min(width, height) >= 1.0:
        return None
    return (width, height) if max(width, height) <= MOST_PIXELS else None


def _ids(value: Any, count: int) -> list[int]:
    """The sender's id of each person, else the person's place in the list."""
    if isinstance(value, list) and len(value) == count and len({*map(str, value)}) == count:
        numbers = [_number(item) for item in value]
        if all(number is not None and number == int(number) for number in numbers):
            return [int(number) for number in numbers if number is not None]
    return list(range(count))
