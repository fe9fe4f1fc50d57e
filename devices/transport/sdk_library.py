"""Loading a maker's shared library, and a reader thread's loop over what it gives."""

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

RETRY = 1.0  # [s] until a sensor that was lost is opened again
_BESIDE_ITSELF = 0x8  # LOAD_WITH_ALTERED_SEARCH_PATH


class SensorLostError(Exception):
    """The sensor answers no more; the message is one line on what to do."""


class SensorSource(Protocol):
    """An open sensor: the thin part that calls the maker's library."""

    def read(self) -> bytes | None:
        """One frame's bytes, or None when none came within about 0.1 s.

        Raises:
            SensorLostError: nothing will come until it is opened again.
        """
        ...

    def close(self) -> None:
        """Give the sensor back."""
        ...


class SensorTransport:
    """A transport over a sensor; one that is unplugged is opened again when it is back.

    Args:
        open_sensor: opens it; raises InputError where it cannot be.

    Attributes:
        dropped: always 0; what a library drops it does not tell.
        trouble: why nothing comes just now.

    Raises:
        InputError: it cannot be opened now.
    """

    dropped = 0

    def __init__(self, open_sensor: Callable[[], SensorSource]) -> None:
        self.trouble = ""
        self._open = open_sensor
        self._closing = threading.Event()
        self._source: SensorSource | None = open_sensor()

    def run(self, deliver: Deliver) -> None:
        """Deliver each frame's bytes with its arrival until it is closed."""
        try:
            while not self._closing.is_set():
                if self._source is None:
                    self._reopen()
                    continue
                self._read(self._source, deliver)
        finally:
            self._release()

    def close(self) -> None:
        """Let `run` return soon; it gives the sensor back on its own thread."""
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
    """The first of the libraries `names` that this machine has.

    On Windows a name is looked for in the system's folder and along PATH, but never in the current
    folder, where anybody may have put it; what the library needs may lie beside it.

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
