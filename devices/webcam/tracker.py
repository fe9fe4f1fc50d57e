"""The program that tracks people in a webcam's pictures or a film, in a process of its own.

It runs in a process of its own, at low priority and on all processor cores but one, so it never
takes the show's core. It writes the messages of `devices.webcam.messages` to its standard output,
and lines for people to its standard error. It ends when its standard input does: with the show.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from devices.errors import InputError
from devices.webcam.landmarkers import Landmarkers
from devices.webcam.messages import BEGIN, FAILED, LANDMARKS, OVER, READY, TROUBLE, write_message
from devices.webcam.models import fetched_models, models_in
from devices.webcam.pictures import Camera, Film

POLITENESS = 10  # niceness
LOOK = 0.25  # [s] after which trouble is reported
PATIENCE = 30.0  # [s] that a camera takes to open at most


def main() -> int:
    """Track until the show or the film ends; the exit code."""
    options = _arguments().parse_args()
    out, tell = _channels()
    begun = threading.Event()
    threading.Thread(target=_watch, args=(sys.stdin.buffer, begun), daemon=True).start()
    make_way()
    try:
        with suppress(BrokenPipeError):
            _run(options, out, tell, begun)
    except InputError as error:
        with suppress(OSError):
            write_message(out, FAILED, str(error).encode())
        return 2
    return 0


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="tracker")
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--film", type=Path)
    parser.add_argument("--people", type=int, default=1)
    parser.add_argument("--no-hands", action="store_true")
    parser.add_argument("--model", type=Path, help="a pose landmarker in place of the fetched one")
    parser.add_argument("--models", type=Path, required=True, help="the folder of fetched models")
    parser.add_argument("--no-fetch", action="store_true")
    return parser


def _channels() -> tuple[BinaryIO, Callable[[str], None]]:
    """The pipe to the show and a way to tell people something, which no library can write to."""
    out = os.fdopen(os.dup(1), "wb")
    try:
        screen: BinaryIO | None = os.fdopen(os.dup(2), "wb")
    except OSError:  # closed
        screen = None
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for channel in (1, 2):
        os.dup2(nowhere, channel)

    def tell(line: str) -> None:
        with suppress(OSError):
            if screen is not None:
                screen.write(f"bunraku: {line}\n".encode())
                screen.flush()

    return out, tell


def _watch(show: BinaryIO, begun: threading.Event) -> None:
    """Note that the show wants the first picture, and end this process when the show ends."""
    while said := show.read(1):
        if said == BEGIN:
            begun.set()
    os._exit(0)


def make_way() -> None:
    """Leave one processor core to the show, and the others when the show needs them."""
    if hasattr(os, "nice"):
        with suppress(OSError):
            os.nice(POLITENESS)
    if sys.platform.startswith("linux"):
        cores = sorted(os.sched_getaffinity(0))
        if len(cores) > 1:
            os.sched_setaffinity(0, cores[1:])


def _run(
    options: argparse.Namespace, out: BinaryIO, tell: Callable[[str], None], begun: threading.Event
) -> None:
    cv2, mediapipe = _libraries()
    if options.no_fetch and options.model is None and models_in(options.models) is None:
        raise InputError(
            "MediaPipe's models are not here yet: the first `bunraku live --device webcam://0` "
            "fetches them"
        )
    film = None if options.film is None else Film(cv2, options.film)
    camera = _open_camera(cv2, options.camera, out) if film is None else None
    landmarkers = _landmarkers(options, mediapipe, cv2, tell)
    write_message(out, READY)
    if film is not None:
        begun.wait()
        track_film(film, landmarkers, out)
    elif camera is not None:
        track_camera(camera, landmarkers, out)


def _landmarkers(
    options: argparse.Namespace, mediapipe: Any, cv2: Any, tell: Callable[[str], None]
) -> Landmarkers:
    hands = not options.no_hands
    models = fetched_models(options.models, tell) if hands or options.model is None else None
    pose = options.model if models is None or options.model is not None else models.pose
    hand = models.hand if hands and models is not None else None
    return Landmarkers(mediapipe, cv2, pose, hand, options.people)


def _libraries() -> tuple[Any, Any]:
    os.environ["MPLBACKEND"] = "Agg"  # MediaPipe loads matplotlib, which would look for a screen
    try:
        import cv2  # noqa: PLC0415  # an optional extra
        import mediapipe  # noqa: PLC0415  # an optional extra
    except (ImportError, OSError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(
            f"MediaPipe or OpenCV cannot be loaded ({reason}); pip install 'bunraku[webcam]', and "
            "on Debian or Ubuntu: apt-get install libgl1 libglib2.0-0"
        ) from error
    return cv2, mediapipe


def _open_camera(cv2: Any, number: int, out: BinaryIO) -> Camera:
    """Open a camera, and give up when its driver hangs."""

    def give_up() -> None:
        line = f"camera {number} does not answer; plug it in again, or give another, webcam://1"
        with suppress(OSError):
            write_message(out, FAILED, line.encode())
        os._exit(2)

    guard = threading.Timer(PATIENCE, give_up)
    guard.daemon = True
    guard.start()
    try:
        return Camera(cv2, number)
    finally:
        guard.cancel()


def track_camera(camera: Camera, landmarkers: Landmarkers, out: BinaryIO) -> None:
    """Write down the newest picture's landmarks, over and over, until the show has ended."""
    told = ""
    while True:
        taken = camera.newest(LOOK)
        if camera.trouble != told:
            told = camera.trouble
            write_message(out, TROUBLE, told.encode())
        if taken is not None:
            picture, seconds = taken
            write_message(out, LANDMARKS, landmarkers.message(picture, round(1e3 * seconds)))


def track_film(film: Film, landmarkers: Landmarkers, out: BinaryIO) -> None:
    """Write down the landmarks of every picture of a film, at most as fast as it plays."""
    began: float | None = None
    for picture, seconds in film.pictures():
        message = landmarkers.message(picture, round(1e3 * seconds))
        if began is None:
            began = time.perf_counter()
        time.sleep(max(began + seconds - time.perf_counter(), 0.0))
        write_message(out, LANDMARKS, message)
    write_message(out, OVER)


if __name__ == "__main__":
    sys.exit(main())
