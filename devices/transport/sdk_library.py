"""Sensors with a maker's shared library: load the library, read frames, reopen lost sensors."""

from __future__ import annotations

import ctypes
import ctypes.util
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from devices.errors import InputError
from devices.transport.live_stream import Deliver

RETRY = 1.0  # [s] until a lost sensor is opened again
_BESIDE_ITSELF = 0x8  # LOAD_WITH_ALTERED_SEARCH_PATH


class SensorLostError(Exception):
    """The sensor no longer answers; the message is one line with what to do."""


class SensorSource(Protocol):
    """An open sensor: the thin layer that calls the maker's library."""

    def read(self) -> bytes | None:
        """Return the bytes of one frame, or None if none came within about 0.1 s.

        Raises:
            SensorLostError: nothing will come until the sensor is opened again.
        """
        ...

    def close(self) -> None:
        """Release the sensor."""
        ...


class SensorTransport:
    """A transport over a sensor; an unplugged sensor is opened again when it returns.

    Args:
        open_sensor: opens the sensor; raises InputError if that fails.

    Attributes:
        dropped: always 0; the libraries do not report dropped frames.
        trouble: one line that explains why nothing comes now, or an empty one.

    Raises:
        InputError: the sensor cannot be opened.
    """

    dropped = 0

    def __init__(self, open_sensor: Callable[[], SensorSource]) -> None:
        self.trouble = ""
        self._open = open_sensor
        self._closing = threading.Event()
        self._source: SensorSource | None = open_sensor()

    def run(self, deliver: Deliver) -> None:
        """Deliver the bytes and arrival of each frame until closed."""
        try:
            while not self._closing.is_set():
                if self._source is None:
                    self._reopen()
                    continue
                self._read(self._source, deliver)
        finally:
            self._release()

    def close(self) -> None:
        """Make `run` return soon; it releases the sensor on its own thread."""
        self._closing.set()

    def _read(self, source: SensorSource, deliver: Deliver) -> None:
        try:
            data = source.read()
        except SensorLostError as error:
            self.trouble = str(error)
            self._release()
            return
        if data is not None:
            self.trouble = ""
            deliver(data, time.perf_counter(), "")

    def _reopen(self) -> None:
        if self._closing.wait(RETRY):
            return
        try:
            self._source = self._open()
        except InputError as error:
            self.trouble = str(error)

    def _release(self) -> None:
        if self._source is not None:
            self._source.close()
            self._source = None


def load_library(names: Sequence[str], missing: str) -> ctypes.CDLL:
    """Return the first of the libraries `names` that this machine has.

    On Windows a name is searched in the system's folder and along PATH, but never in the current
    folder, which may hold foreign files; dependencies may lie beside the library.

    Raises:
        InputError: there is none; the message is `missing`.
    """
    for name in names:
        try:
            return _load(name)
        except OSError:
            continue
    raise InputError(missing)


def _load(name: str) -> ctypes.CDLL:
    windows: Callable[..., ctypes.CDLL] | None = getattr(ctypes, "WinDLL", None)
    if windows is None:
        return ctypes.CDLL(name)
    found = ctypes.util.find_library(name)
    if found is None or not Path(found).is_absolute():
        return windows(name)
    return windows(found, winmode=_BESIDE_ITSELF)
