"""The tracker's models: downloaded once as a wheel, checked, and kept in the user's folder.

MediaPipe's releases from 0.10.31 on hold no models. The wheel of 0.10.21 holds the pose and hand
models (Apache License 2.0). pip fetches it, so mirrors and proxies that are set up for pip are
used, and the wheel is taken for this one file whatever machine this is. Nothing of it is run.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from devices.errors import InputError
from devices.webcam.task_file import PIXELS_FROM_0_TO_1, task_file, with_pixel_range

RELEASE = "mediapipe==0.10.21"
WHEEL = "mediapipe-0.10.21-cp312-cp312-manylinux_2_28_x86_64.whl"
SHA256 = "956eb1ebc275c629e61b085b2cab89c3a5b9e93bad1bb107348d98dafb5a4bb5"
MEGABYTES = 36
LICENSE = "mediapipe-0.10.21.dist-info/LICENSE"
POSE, HAND = "pose.task", "hand.task"

_TASKS = {
    POSE: {
        "pose_detector.tflite": "pose_detection/pose_detection.tflite",
        "pose_landmarks_detector.tflite": "pose_landmark/pose_landmark_full.tflite",
    },
    HAND: {
        "hand_detector.tflite": "palm_detection/palm_detection_full.tflite",
        "hand_landmarks_detector.tflite": "hand_landmark/hand_landmark_full.tflite",
    },
}
_MODULES = "mediapipe/modules"
_DOWNLOAD = (
    *("-m", "pip", "download", RELEASE, "--no-deps", "--only-binary=:all:"),
    *("--implementation", "cp", "--python-version", "3.12", "--abi", "cp312"),
    *("--platform", "manylinux_2_28_x86_64", "--retries", "1", "--timeout", "20"),
    *("--no-input", "--disable-pip-version-check", "--progress-bar", "off"),
)
_NO_NETWORK = ("NewConnectionError", "NameResolution", "ConnectTimeout", "ProxyError", "Retrying")


@dataclass(frozen=True, slots=True)
class Models:
    """The models that MediaPipe's tasks read."""

    pose: Path
    hand: Path


def models_in(folder: Path) -> Models | None:
    """The models in a folder; None unless all are there and undamaged."""
    models = Models(folder / POSE, folder / HAND)
    return models if all(map(_is_whole, (models.pose, models.hand))) else None


def fetched_models(
    folder: Path,
    tell: Callable[[str], None],
    *,
    python: Sequence[str] = (sys.executable,),
) -> Models:
    """Return the models in a folder, and fetch them first where they are not there.

    Args:
        folder: of the models; it is made if it is missing. A wheel that lies there is not fetched.
        tell: takes one line before anything is fetched, and one after.
        python: the command of the Python whose pip fetches.

    Raises:
        InputError: they cannot be fetched or kept; the message says why and what to do.
    """
    models = models_in(folder)
    if models is not None:
        return models
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if _sha256(folder / WHEEL) == SHA256:
            _unpack(folder / WHEEL, folder)
        else:
            tell(
                f"fetching MediaPipe's models into {folder}, once: {MEGABYTES} MB, "
                f"by pip from {RELEASE} (Apache License 2.0)"
            )
            with tempfile.TemporaryDirectory(dir=folder) as partial:
                _unpack(_download(Path(partial), python), folder)
            tell("MediaPipe's models are there; later starts need no network")
    except OSError as error:
        raise InputError(
            f"MediaPipe's models cannot be kept in {folder} ({error.strerror or error}); free "
            "space, or set another folder for caches"
        ) from error
    return Models(folder / POSE, folder / HAND)


def _download(into: Path, python: Sequence[str]) -> Path:
    """The wheel, fetched by pip and checked."""
    done = subprocess.run(
        [*python, *_DOWNLOAD, "--dest", str(into)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    wheel = into / WHEEL
    if done.returncode != 0 or not wheel.is_file():
        raise InputError(f"MediaPipe's models could not be fetched: {_reason(done.stdout)}")
    if (found := _sha256(wheel)) != SHA256:
        raise InputError(
            f"MediaPipe's models could not be fetched: the package index gave another {WHEEL} "
            f"(SHA-256 {found[:12]}... instead of {SHA256[:12]}...); use another index"
        )
    return wheel


def _reason(output: str) -> str:
    """What pip's output says, in a few words, and what to do."""
    if "No module named pip" in output:
        return "this Python has no pip; run: python -m ensurepip"
    if any(word in output for word in _NO_NETWORK):
        return f"no network; connect once ({MEGABYTES} MB), later starts work without it"
    errors = [line for line in output.splitlines() if line.startswith("ERROR:")]
    said = errors[-1].removeprefix("ERROR:") if errors else "it ended without a wheel"
    return f"pip download {RELEASE} says:{' '.join(f' {said}'.split(' '))[:200]}"


def _unpack(wheel: Path, folder: Path) -> None:
    """Make the files of the tasks from the models in a wheel that was checked."""
    with zipfile.ZipFile(wheel) as archive:
        for name, parts in _TASKS.items():
            models = {part: archive.read(f"{_MODULES}/{path}") for part, path in parts.items()}
            if name == POSE:  # the only model that does not say it itself
                model = models["pose_landmarks_detector.tflite"]
                models["pose_landmarks_detector.tflite"] = with_pixel_range(
                    model, PIXELS_FROM_0_TO_1
                )
            _keep(folder / name, task_file(models))
        _keep(folder / "LICENSE", archive.read(LICENSE))


def _keep(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    partial = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _is_whole(path: Path) -> bool:
    """Whether a task's file has what its own check sums say."""
    with suppress(OSError, zipfile.BadZipFile), zipfile.ZipFile(path) as archive:
        return archive.testzip() is None
    return False


def _sha256(path: Path) -> str:
    """The check sum of a file, empty where there is none."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
