"""Starts the tracker's process, reads its messages, and ends it."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from devices.errors import InputError
from devices.transport.live_stream import Deliver
from devices.webcam.messages import BEGIN, FAILED, LANDMARKS, OVER, READY, TROUBLE, read_message

RETRY = 1.0  # [s] until a tracker that has ended is started again
PATIENCE = 2.0  # [s] that it takes to end at most
_ROOT = Path(__file__).resolve().parents[2]  # of the packages, installed or not
_BELOW_NORMAL = 0x4000  # BELOW_NORMAL_PRIORITY_CLASS of Windows
_NEW_GROUP = 0x200  # CREATE_NEW_PROCESS_GROUP: Ctrl-C is for the show


class TrackerEndedError(Exception):
    """The tracker's process has ended; the message is one line that says why."""


class TrackerProcess:
    """A running tracker whose camera or film is open.

    Args:
        command: starts it, without the interpreter: ("-m", "devices.webcam.tracker", ...).

    Raises:
        InputError: the camera or film cannot be opened, or the tracker does not start.
    """

    def __init__(self, command: Sequence[str]) -> None:
        windows = sys.platform == "win32"
        self._process = subprocess.Popen(
            # -P: whatever lies in the folder that the show was started from is not imported.
            [sys.executable, "-P", *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": _search_path()},
            start_new_session=not windows,
            creationflags=_BELOW_NORMAL | _NEW_GROUP if windows else 0,
        )
        try:
            kind, data = self.receive()
        except TrackerEndedError as error:
            self.close()
            raise InputError(f"cannot open webcam://: {error}") from None
        except BaseException:  # Ctrl-C, while models are fetched
            self.close()
            raise
        if kind != READY:
            self.close()
            raise InputError(f"cannot open webcam://: {_text(data)}")

    def receive(self) -> tuple[bytes, bytes]:
        """Wait for the next message; return its kind and bytes.

        Raises:
            TrackerEndedError: there is none any more.
        """
        assert self._process.stdout is not None
        try:
            message = read_message(self._process.stdout)
        except (OSError, ValueError):  # closed by another thread
            message = None
        if message is None:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(PATIENCE)
            raise TrackerEndedError(
                f"the tracker has ended (exit code {self._process.poll()}); start again, and "
                "report this if it ends again"
            )
        return message

    def begin(self) -> None:
        """Ask for the first picture of a film."""
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):
            self._process.stdin.write(BEGIN)
            self._process.stdin.flush()

    def close(self) -> None:
        """End the process; may be called twice, and from any thread."""
        self._process.kill()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(PATIENCE)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(OSError, ValueError):
                pipe.close()


class CameraTransport:
    """The messages of a camera's tracker, which is started again if it ends.

    Args:
        start: starts the tracker.

    Attributes:
        dropped: always 0; pictures that come while one is looked at are not counted.
        trouble: one line that says why nothing comes now, or an empty one.

    Raises:
        InputError: of `start`.
    """

    dropped = 0

    def __init__(self, start: Callable[[], TrackerProcess]) -> None:
        self.trouble = ""
        self._start = start
        self._closing = threading.Event()
        self._tracker = start()

    def run(self, deliver: Deliver) -> None:
        """Deliver the landmarks of each picture until closed."""
        while not self._closing.is_set():
            try:
                kind, data = self._tracker.receive()
            except TrackerEndedError as error:
                self._restart(str(error))
                continue
            if kind == LANDMARKS:
                self.trouble = ""
                deliver(data, time.perf_counter(), "")
            elif kind in (TROUBLE, FAILED):
                self.trouble = _text(data)

    def close(self) -> None:
        """End the tracker, and with it `run`."""
        self._closing.set()
        self._tracker.close()

    def _restart(self, why: str) -> None:
        if self._closing.is_set():
            return
        self.trouble = self.trouble or why
        self._tracker.close()
        if self._closing.wait(RETRY):
            return
        try:
            self._tracker = self._start()
        except InputError as error:
            self.trouble = str(error)
        if self._closing.is_set():
            self._tracker.close()


class FilmTransport:
    """The messages of a film's tracker, from the first picture on once the show wants it.

    Args:
        tracker: of the film.

    Attributes:
        dropped: always 0: each picture is looked at.
        trouble: one line that says why nothing comes any more, or an empty one.
        over: whether nothing comes any more.
    """

    dropped = 0

    def __init__(self, tracker: TrackerProcess) -> None:
        self.trouble = ""
        self.over = False
        self._tracker = tracker
        self._begun = False

    def begin(self) -> None:
        """Ask for the first picture; does nothing when called again."""
        if not self._begun:
            self._begun = True
            self._tracker.begin()

    def run(self, deliver: Deliver) -> None:
        """Deliver the landmarks of each picture until the film is over or closed."""
        try:
            while not self.over:
                kind, data = self._tracker.receive()
                if kind == LANDMARKS:
                    deliver(data, time.perf_counter(), "")
                elif kind in (OVER, FAILED):
                    self.trouble = _text(data)
                    break
        except TrackerEndedError as error:
            self.trouble = str(error)
        finally:
            self.over = True

    def close(self) -> None:
        """End the tracker, and with it `run`."""
        self._tracker.close()


def _text(data: bytes) -> str:
    return " ".join(data.decode("utf-8", "replace").split())


def _search_path() -> str:
    """Where the tracker's Python finds this package, whatever folder the show was started from."""
    return os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH", ""))))
