"""Device ``webcam://0`` (a camera) and ``webcam:///path/film.mp4``: people by MediaPipe.

A tracker in a process of its own finds them (`devices/webcam/tracker.py`), so neither its
libraries nor its work come into the show's. Needs the extra; its models are fetched once.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import SplitResult, unquote

from devices.address import one_of, options_of
from devices.errors import InputError
from devices.mediapipe.landmark_messages import USUAL_VIEW, LandmarkDecoder
from devices.mediapipe.stream import view_angle
from devices.skeleton import SkeletonFrame
from devices.transport.inbox import CAPACITY
from devices.transport.live_stream import LiveStream
from devices.webcam.tracker_process import CameraTransport, FilmTransport, TrackerProcess
from solvers.kernels.cache import cache_folder

TRACKER = ("-m", "devices.webcam.tracker")
RELEASES = ((0, 10, 31), (0, 10, 34))
"""MediaPipe from here and below there: older ones hold other tasks, newer ones send figures about
their use to their maker."""

MOST_PEOPLE = 4
EXTRA = "pip install 'bunraku[webcam]'"
_USAGE = "expected webcam://0, the camera's number, or webcam:///path/film.mp4"


class FilmClock:
    """Times of a film on the host's clock: it plays at its own speed, however late pictures come.

    A film is never ahead of its time; where the tracker is slower, it plays more slowly.
    """

    def __init__(self) -> None:
        self._offset: float | None = None

    def host_time(self, device: float, arrival: float) -> float:
        """Return the host time [s] of a film's time [s] that arrived at `arrival` [s]."""
        if self._offset is None:
            self._offset = arrival - device
        return min(device + self._offset, arrival)


class FilmStream(LiveStream):
    """The people in a film, which begins with the first poll and ends with its last picture."""

    def __init__(self, transport: FilmTransport, *, hands: bool, view: float) -> None:
        self._film = transport
        super().__init__(
            transport,
            lambda: LandmarkDecoder(hands=hands, view=view, clock=FilmClock()),
            capacity=CAPACITY,
        )

    @property
    def ended(self) -> bool:
        """True once every picture's frames were taken, or it is closed."""
        return super().ended or (self._film.over and not self.wait(0.0))

    def poll(self) -> Sequence[SkeletonFrame]:
        """Return the frames since the last poll, oldest first; never blocks."""
        self._film.begin()
        return super().poll()


def open_device(address: SplitResult) -> LiveStream:
    """Open ``webcam://0?people=2&hands=off&view=60`` or ``webcam:///path/film.mp4``.

    Raises:
        InputError: the address is wrong, the extra is not installed, there is no such camera or
            film, or its models could not be fetched.
    """
    options = options_of(
        address,
        {
            "people": _people,
            "hands": one_of("on", "off"),
            "view": view_angle,
            "model": Path,
            "fetch": one_of("on", "off"),
        },
    )
    film = _film(address)
    command = [*TRACKER, "--models", str(model_folder()), "--people", str(options.get("people", 1))]
    command += ["--camera", address.netloc or "0"] if film is None else ["--film", str(film)]
    command += ["--no-fetch"] if options.get("fetch") == "off" else []
    command += ["--model", str(options["model"])] if "model" in options else []
    hands = options.get("hands", "on") == "on"
    command += [] if hands else ["--no-hands"]
    _check_extra()
    view = options.get("view", USUAL_VIEW)
    if film is not None:
        return FilmStream(FilmTransport(TrackerProcess(command)), hands=hands, view=view)
    return LiveStream(
        CameraTransport(lambda: TrackerProcess(command)),
        lambda: LandmarkDecoder(hands=hands, view=view),
    )


def model_folder() -> Path:
    """Where the tracker's models are kept."""
    return cache_folder() / "webcam"


def _film(address: SplitResult) -> Path | None:
    """The film of an address; None for a camera.

    Raises:
        InputError: it is neither a film nor a camera.
    """
    where = f"cannot open {address.geturl()!r}"
    if address.fragment:
        raise InputError(f"{where}: write %23 for # in a file's name")
    number = address.netloc
    if number.isascii() and number.isdigit() and len(number) < 4 and address.path in ("", "/"):
        return None
    if number or not address.path.strip("/"):
        raise InputError(f"{where}: {_USAGE}")
    named = address.path
    if len(named) > 2 and named[0] == "/" and named[2] == ":":  # /C:/films/film.mp4
        named = named[1:]
    film = Path(named) if Path(named).is_file() else Path(unquote(named))
    if not film.is_file():
        raise InputError(f"{where}: there is no file {film}")
    return film


def _check_extra() -> None:
    """Refuse a MediaPipe that is missing, or whose release does other things.

    Raises:
        InputError: it is so.
    """
    if find_spec("mediapipe") is None or find_spec("cv2") is None:
        raise InputError(f"webcam:// needs the extra: {EXTRA}")
    try:
        found = version("mediapipe")
    except PackageNotFoundError:
        return
    numbers = tuple(int(part) for part in found.split(".")[:3] if part.isdecimal())
    if not RELEASES[0] <= numbers < RELEASES[1]:
        oldest, end = (".".join(map(str, release)) for release in RELEASES)
        raise InputError(
            f"webcam:// needs a MediaPipe from {oldest} and below {end}, found {found} (later "
            f"ones send figures about their use to their maker): {EXTRA}"
        )


def _people(text: str) -> int:
    if text not in map(str, range(1, MOST_PEOPLE + 1)):
        raise ValueError(f"expected a number of people from 1 to {MOST_PEOPLE}")
    return int(text)
