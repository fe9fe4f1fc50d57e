"""Finds people and their hands in pictures by MediaPipe, and writes their landmarks."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.mediapipe.joints import POSE_LANDMARKS, SIDES
from devices.webcam.hand_tiles import (
    WRIST,
    Tile,
    corner,
    hand_tiles,
    hands_of_tiles,
    mosaic_size,
    picture_to_tile,
)
from devices.webcam.people import PeopleIds

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

DIGITS = 5  # after the point: hundredths of millimetres
_TRUNK = [
    POSE_LANDMARKS.index(f"{side}_{joint}") for side in SIDES for joint in ("shoulder", "hip")
]


class Landmarkers:
    """MediaPipe's models, which track from picture to picture.

    Args:
        mediapipe, cv2: the libraries.
        pose: the pose landmarker's model file (.task).
        hand: the hand landmarker's; None to look for no hands.
        people: largest number of people.

    Raises:
        InputError: MediaPipe cannot read a model.
    """

    def __init__(
        self, mediapipe: Any, cv2: Any, pose: Path, hand: Path | None, people: int
    ) -> None:
        self._mediapipe, self._cv2 = mediapipe, cv2
        vision = mediapipe.tasks.vision
        self._pose = self._open(
            vision.PoseLandmarker, vision.PoseLandmarkerOptions, pose, num_poses=people
        )
        self._hand: Any = None
        if hand is not None:
            self._hand = self._open(
                vision.HandLandmarker, vision.HandLandmarkerOptions, hand, num_hands=2 * people
            )
        self._mosaic = np.zeros((*mosaic_size(people)[::-1], 3), dtype=np.uint8)
        self._ids = PeopleIds()
        self._last = -1

    def message(self, picture: Picture, milliseconds: int) -> bytes:
        """Return a message with the landmarks of all people in a picture.

        Args:
            picture: (H, W, 3) RGB.
            milliseconds: its time.
        """
        self._last = stamp = max(milliseconds, self._last + 1)  # MediaPipe wants them to rise
        found = self._pose.detect_for_video(self._image(picture), stamp)
        size = picture.shape[1], picture.shape[0]
        world = [_rows(person) for person in found.pose_world_landmarks]
        image = [_rows(person) for person in found.pose_landmarks]
        places = [person[_TRUNK, :2].mean(axis=0) * (1.0, size[1] / size[0]) for person in image]
        message = {
            "timestamp_ms": milliseconds,
            "image_size": size,
            "pose_world_landmarks": _lists(world),
            "pose_landmarks": _lists(image),
            "ids": self._ids(places),
        }
        if self._hand is not None:
            hands = self._hands(picture, stamp, world, image)
            for number, side in enumerate(SIDES):
                message[f"{side}_hand_world_landmarks"] = _lists(
                    [hands.get(2 * row + number, np.empty((0, 3))) for row in range(len(world))]
                )
        return json.dumps(message, separators=(",", ":")).encode()

    def _hands(
        self, picture: Picture, stamp: int, world: Sequence[Array], image: Sequence[Array]
    ) -> dict[int, Array]:
        """The world landmarks (21, 3) of the hands in each slot."""
        size = picture.shape[1], picture.shape[0]
        tiles = [
            tile
            for row, (shape, seen) in enumerate(zip(world, image, strict=True))
            for tile in hand_tiles(shape, seen[:, :2] * size, size, row)
        ]
        if not tiles:
            return {}
        self._lay(picture, tiles)
        found = self._hand.detect_for_video(self._image(self._mosaic), stamp)
        wide, high = self._mosaic.shape[1], self._mosaic.shape[0]
        wrists = [(hand[WRIST].x * wide, hand[WRIST].y * high) for hand in found.hand_landmarks]
        shown = hands_of_tiles(tiles, np.array(wrists).reshape(-1, 2))
        return {
            slot: _rows(found.hand_world_landmarks[hand])[:, :3] for slot, hand in shown.items()
        }

    def _lay(self, picture: Picture, tiles: Sequence[Tile]) -> None:
        """Lay the tiles into the mosaic; where none is, it is black."""
        self._mosaic[:] = 0
        for tile in tiles:
            x, y = corner(tile.slot)
            side = mosaic_size(1)[1]
            self._mosaic[y : y + side, x : x + side] = self._cv2.warpAffine(
                picture, picture_to_tile(tile), (side, side), flags=self._cv2.INTER_LINEAR
            )

    def _image(self, picture: Picture) -> Any:
        return self._mediapipe.Image(
            image_format=self._mediapipe.ImageFormat.SRGB, data=np.ascontiguousarray(picture)
        )

    def _open(self, task: Any, options: Any, model: Path, **more: int) -> Any:
        try:
            return task.create_from_options(
                options(
                    base_options=self._mediapipe.tasks.BaseOptions(model_asset_path=str(model)),
                    running_mode=self._mediapipe.tasks.vision.RunningMode.VIDEO,
                    **more,
                )
            )
        except (RuntimeError, ValueError, OSError) as error:
            reason = " ".join(str(error).split())[:120]
            raise InputError(
                f"{model} is not a model that MediaPipe can use here ({reason})"
            ) from error


def _rows(landmarks: Sequence[Any]) -> Array:
    """(N, 4) x, y, z and visibility."""
    return np.array(
        [
            (point.x, point.y, point.z, 1.0 if point.visibility is None else point.visibility)
            for point in landmarks
        ]
    )


def _lists(people: Sequence[Array]) -> list[Any]:
    return [np.round(person, DIGITS).tolist() for person in people]
