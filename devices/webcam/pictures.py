"""Pictures by OpenCV: only the newest from a camera, one after another from a film."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError

Picture = NDArray[np.uint8]

RETRY = 1.0  # [s] until a lost camera is opened again
USUAL_RATE = 30.0  # [Hz] of a film that does not say it
PLAUSIBLE_RATE = (1.0, 1000.0)  # [Hz]


class Camera:
    """A camera whose pictures a thread of its own takes, so that the newest is always at hand.

    Args:
        cv2: the library.
        number: of the camera.

    Attributes:
        trouble: one line that says why nothing comes now, or an empty one.

    Raises:
        InputError: it cannot be opened, or gives no picture.
    """

    def __init__(self, cv2: Any, number: int) -> None:
        self.trouble = ""
        self._cv2, self._number = cv2, number
        self._capture = cv2.VideoCapture(number)
        there, first = self._capture.read() if self._capture.isOpened() else (False, None)
        if not there or first is None:
            self._capture.release()
            raise InputError(why_no_pictures(number))
        self._newest: tuple[Picture, float] | None = (first, time.perf_counter())
        self._came = threading.Condition()
        threading.Thread(target=self._take, name="camera", daemon=True).start()

    def newest(self, seconds: float) -> tuple[Picture, float] | None:
        """Wait at most `seconds` for a picture that was not returned yet.

        Returns:
            The picture (H, W, 3) RGB and its time on the host's monotonic clock [s], or None.
        """
        with self._came:
            self._came.wait_for(lambda: self._newest is not None, seconds)
            taken, self._newest = self._newest, None
        if taken is None:
            return None
        return self._cv2.cvtColor(taken[0], self._cv2.COLOR_BGR2RGB), taken[1]

    def _take(self) -> None:
        while True:
            there, picture = self._capture.read()
            if there:
                with self._came:
                    self.trouble = ""
                    self._newest = picture, time.perf_counter()
                    self._came.notify()
                continue
            self.trouble = f"camera {self._number} gives no more pictures; plug it in again"
            self._capture.release()
            time.sleep(RETRY)
            self._capture = self._cv2.VideoCapture(self._number)


def why_no_pictures(number: int, folder: Path = Path("/dev")) -> str:
    """Say why a camera gives no pictures, and what to do.

    Args:
        number: of the camera.
        folder: where Linux has its cameras.
    """
    what = f"camera {number}"
    if not sys.platform.startswith("linux"):
        return (
            f"{what} gives no pictures: plug it in, close other programs that use it, let this "
            "program use it in the system's settings, or give another number, webcam://1"
        )
    node = folder / f"video{number}"
    if not node.exists():
        others = sorted(
            int(one.name.removeprefix("video"))
            for one in folder.glob("video*")
            if one.name.removeprefix("video").isdecimal()
        )
        here = f"there are {', '.join(map(str, others))}" if others else "there is none here"
        return f"no {what}, {here}: plug one in, or give a film, webcam:///path/film.mp4"
    if not os.access(node, os.R_OK | os.W_OK):
        return f"{what} is not open to you: ask for the rights to {node}, often the group 'video'"
    return (
        f"{what} gives no pictures: close other programs that use it, or give another number, "
        f"webcam://{number + 1}"
    )


class Film:
    """The pictures of a film, each once, in order.

    Args:
        cv2: the library.
        path: of the file.

    Raises:
        InputError: the file holds no film that can be read.
    """

    def __init__(self, cv2: Any, path: Path) -> None:
        self._cv2, self._path = cv2, path
        # A film's own text, such as a list of other files or addresses, opens files alone.
        os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = "protocol_whitelist;file"
        self._capture = cv2.VideoCapture(str(path.absolute()), cv2.CAP_FFMPEG)
        there, first = self._capture.read() if self._capture.isOpened() else (False, None)
        if not there or first is None:
            raise InputError(
                f"{path} holds no film that can be read here; convert it to MP4 (H.264)"
            )
        self._first: Picture = first
        rate = float(self._capture.get(cv2.CAP_PROP_FPS))
        self._step = 1.0 / (rate if PLAUSIBLE_RATE[0] <= rate <= PLAUSIBLE_RATE[1] else USUAL_RATE)

    def pictures(self) -> Iterator[tuple[Picture, float]]:
        """Each picture (H, W, 3) RGB, and its time from the first on [s]; times rise."""
        last, began = -self._step, self._stamp()
        picture: Picture | None = self._first
        while picture is not None:
            stamp = self._stamp() - began
            last = stamp if stamp > last else last + self._step
            yield self._cv2.cvtColor(picture, self._cv2.COLOR_BGR2RGB), last
            there, picture = self._capture.read()
            picture = picture if there else None

    def _stamp(self) -> float:
        """The film's own time of the last picture that was read [s]."""
        return 1e-3 * float(self._capture.get(self._cv2.CAP_PROP_POS_MSEC))
