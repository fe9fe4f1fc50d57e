"""A microphone: what is heard while a take is recorded becomes the take's sound."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Protocol, Self

import numpy as np

from devices.errors import InputError
from runtime.sound.sound import LONGEST, Samples, Sound

USUAL = "default"  # the name of the microphone that the system uses


class SoundSource(Protocol):
    """Where samples come from.

    Attributes:
        rate: samples a second.
        latency: [s] from a sound until its sample is given.
    """

    rate: int
    latency: float

    def start(self, give: Callable[[Samples], None]) -> None:
        """Give samples (S, C) of int16 from now on, in order, from any thread."""
        ...

    def close(self) -> None:
        """Give no more."""
        ...


class Microphone:
    """Keeps the samples of a source between the beginning and the end of a take.

    A sample is given some time after it was heard; what had been heard before the beginning is left
    out. After an hour no more is kept.

    Args:
        source: is started, and closed with this.
    """

    def __init__(self, source: SoundSource) -> None:
        self._source = source
        self._lock = threading.Lock()
        self._kept: list[Samples] | None = None
        self._room = self._early = 0
        source.start(self._take)

    def begin(self) -> None:
        """Keep what is heard from now on; what was kept before is dropped."""
        with self._lock:
            self._kept = []
            self._early = round(self._source.latency * self._source.rate)
            self._room = round(LONGEST * self._source.rate)

    def end(self) -> Sound | None:
        """Return what was heard since the beginning; None where that is nothing."""
        with self._lock:
            kept, self._kept = self._kept, None
        if not kept:
            return None
        return Sound(np.concatenate(kept), self._source.rate)

    def close(self) -> None:
        """Close the source."""
        self._source.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _take(self, samples: Samples) -> None:
        with self._lock:
            if self._kept is None:
                return
            early = min(self._early, len(samples))
            self._early -= early
            heard = samples[early : early + self._room].copy()
            self._room -= len(heard)
            if len(heard):
                self._kept.append(heard)


class SystemMicrophone:
    """A microphone of this machine.

    Args:
        name: its number or a part of its name, as the system lists it; "default" for the usual one.

    Raises:
        InputError: the library is missing, or there is no such microphone.
    """

    def __init__(self, name: str) -> None:
        sounddevice = _import_sounddevice()
        device = None if name == USUAL else int(name) if name.isdecimal() else name
        try:
            found = sounddevice.query_devices(device, "input")
            self.rate = round(found["default_samplerate"])
            self._give: Callable[[Samples], None] = lambda _: None
            self._stream = sounddevice.InputStream(
                samplerate=self.rate,
                device=device,
                channels=min(int(found["max_input_channels"]), 2),
                dtype="int16",
                latency="low",
                callback=lambda samples, _frames, _time, _status: self._give(samples),
            )
            self._stream.start()
        except (ValueError, OSError, sounddevice.PortAudioError) as error:
            which = "a microphone" if name == USUAL else f"the microphone {name!r}"
            reason = " ".join(str(error).split())
            raise InputError(f"cannot open {which}: {reason}") from error
        self.latency = float(self._stream.latency)

    def start(self, give: Callable[[Samples], None]) -> None:
        """Give samples from now on: see `SoundSource.start`."""
        self._give = give

    def close(self) -> None:
        """Give no more."""
        self._stream.close()


def _import_sounddevice() -> Any:
    try:
        import sounddevice  # noqa: PLC0415  # an optional extra
    except ImportError as error:
        raise InputError(
            "a microphone needs the extra: pip install 'bunraku[microphone]'"
        ) from error
    except OSError as error:  # the library below it, which Linux does not bring
        raise InputError(
            f"a microphone needs PortAudio (apt install libportaudio2): {error}"
        ) from error
    return sounddevice
