"""Detect people in a webcam's pictures with MediaPipe, on the device's reader thread."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

from devices.errors import InputError
from devices.transport.sdk_library import SensorLostError

MOST_PEOPLE = 2


class Webcam:
    """An open camera and a pose landmarker.

    Args:
        model: the pose landmarker's model file (.task), which is not part of MediaPipe's package.
        camera: number of the camera.

    Raises:
        InputError: the extra is not installed, the file does not exist, MediaPipe cannot read it,
            or there is no such camera.
    """

    def __init__(self, model: Path, camera: int) -> None:
        try:
            import cv2  # noqa: PLC0415  # an optional extra
            import mediapipe  # noqa: PLC0415  # an optional extra
        except ImportError:
            raise InputError(
                "mediapipe://webcam needs the extra: pip install 'bunraku[mediapipe]'"
            ) from None
        if not model.is_file():
            raise InputError(f"cannot open mediapipe://webcam: there is no model file {model}")
        self._cv2, self._mediapipe = cv2, mediapipe
        try:
            self._landmarker = _landmarker(mediapipe, model)
        except (RuntimeError, ValueError, OSError) as error:
            reason = " ".join(str(error).split())[:120]
            raise InputError(
                f"cannot open mediapipe://webcam: {model} is not a pose landmarker model ({reason})"
            ) from error
        self._camera = cv2.VideoCapture(camera)
        if not self._camera.isOpened():
            self.close()
            raise InputError(
                f"cannot open mediapipe://webcam: no camera {camera}; plug it in, close other "
                "programs that use it, or name another with ?camera=1"
            )

    def read(self) -> bytes | None:
        """Return a message with the landmarks in the next picture."""
        there, picture = self._camera.read()
        if not there:
            raise SensorLostError("the webcam no longer gives pictures; plug it in again")
        image = self._mediapipe.Image(
            image_format=self._mediapipe.ImageFormat.SRGB,
            data=self._cv2.cvtColor(picture, self._cv2.COLOR_BGR2RGB),
        )
        milliseconds = time.perf_counter_ns() // 1_000_000
        found = self._landmarker.detect_for_video(image, milliseconds)
        height, width = picture.shape[:2]
        return landmark_message(found, milliseconds, (width, height))

    def close(self) -> None:
        """Release the camera."""
        self._landmarker.close()
        self._camera.release()


def _landmarker(mediapipe: Any, model: Path) -> Any:
    vision = mediapipe.tasks.vision
    return vision.PoseLandmarker.create_from_options(
        vision.PoseLandmarkerOptions(
            base_options=mediapipe.tasks.BaseOptions(model_asset_path=str(model)),
            running_mode=vision.RunningMode.VIDEO,
            num_poses=MOST_PEOPLE,
        )
    )


def landmark_message(result: Any, milliseconds: int, size: tuple[int, int]) -> bytes:
    """Return the message for a MediaPipe result.

    Args:
        result: of a pose landmarker.
        milliseconds: time of the picture.
        size: width and height [pixels] of the picture.
    """

    def people(name: str) -> list[list[list[float]]]:
        return [
            [[point.x, point.y, point.z, point.visibility] for point in person]
            for person in getattr(result, name)
        ]

    names = ("pose_world_landmarks", "pose_landmarks")
    message = {"timestamp_ms": milliseconds, "image_size": size} | {n: people(n) for n in names}
    return json.dumps(message).encode()
