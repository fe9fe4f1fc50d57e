"""The sound of a video: a WAV file that is encoded along with the pictures."""

from __future__ import annotations

import wave
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import numpy as np

from devices.errors import InputError

_ENCODERS = {".webm": ("libopus", "libvorbis")}
_USUAL = ("aac",)
_BITS = 192_000  # a second
_PIECE = 1024  # samples that are encoded together


class VideoSound:
    """Encodes a WAV file of 16-bit PCM into a video, from its first picture on.

    Args:
        av: PyAV.
        container: of the video, before anything is written.
        wav: the sound.
        suffix: of the video, which decides on the encoder.

    Raises:
        InputError: the sound cannot be read, or no encoder for it is there.
    """

    def __init__(self, av: Any, container: Any, wav: Path, suffix: str) -> None:
        self._av = av
        names = _ENCODERS.get(suffix, _USUAL)
        name = next((each for each in names if each in av.codecs_available), None)
        if name is None:
            raise InputError(f"this PyAV has none of the encoders of sound {', '.join(names)}")
        try:
            self._file = wave.open(str(wav), "rb")  # noqa: SIM115  # closed with the video
        except (OSError, wave.Error, EOFError) as error:
            raise InputError(f"cannot read {wav}: {error}") from error
        self._rate = self._file.getframerate()
        self._layout = "mono" if self._file.getnchannels() == 1 else "stereo"
        self._stream = container.add_stream(name, rate=self._rate, layout=self._layout)
        self._stream.bit_rate = _BITS
        self._container, self._done = container, 0

    def advance(self, seconds: float) -> None:
        """Encode the sound up to so many seconds after the first picture."""
        while self._done < seconds * self._rate:
            data = self._file.readframes(_PIECE)
            if not data:
                return
            samples = np.frombuffer(data, "<i2").astype(np.int16).reshape(1, -1)
            frame = self._av.AudioFrame.from_ndarray(samples, format="s16", layout=self._layout)
            frame.sample_rate, frame.pts = self._rate, self._done
            frame.time_base = Fraction(1, self._rate)
            self._done += frame.samples
            self._container.mux(self._stream.encode(frame))

    def finish(self, seconds: float) -> None:
        """Encode the sound up to the end of the video [s], and all that is held back."""
        self.advance(seconds)
        self._container.mux(self._stream.encode(None))

    def close(self) -> None:
        """Close the file that was read."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
