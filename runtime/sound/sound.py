"""A recorded sound: read from files, and written as WAV."""

from __future__ import annotations

import hashlib
import io
import wave
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError

Samples = NDArray[np.int16]

LONGEST = 3600.0  # [s] of a sound
RATES = (4_000, 192_000)  # samples a second
_CHUNK = 1 << 16  # samples that are read together


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """Sampled sound.

    Attributes:
        samples: (S, C) int16, of one or two channels.
        rate: samples a second.
    """

    samples: Samples
    rate: int

    @property
    def seconds(self) -> float:
        """How long it lasts [s]."""
        return len(self.samples) / self.rate

    @property
    def wav(self) -> bytes:
        """The sound as a WAV file of 16-bit PCM; equal sounds have equal bytes."""
        file = io.BytesIO()
        with wave.open(file, "wb") as written:
            written.setnchannels(self.samples.shape[1])
            written.setsampwidth(2)
            written.setframerate(self.rate)
            written.writeframes(self.samples.astype("<i2").tobytes())
        return file.getvalue()

    @property
    def key(self) -> str:
        """A name by its content."""
        return hashlib.sha256(self.wav).hexdigest()[:32]


def read_sound(path: Path) -> Sound:
    """Read a sound: WAV of 16-bit PCM by itself, anything else, such as FLAC or MP3, with PyAV.

    Of more than two channels the first two count.

    Raises:
        InputError: it cannot be read, holds no sound, or lasts more than an hour.
    """
    try:
        with path.open("rb") as file:
            sound = _read_wav(file) or _decoded(path)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise InputError(f"cannot read {path}: {error}") from error
    if len(sound.samples) == 0:
        raise InputError(f"{path} holds no sound")
    return sound


def _read_wav(file: Any) -> Sound | None:
    """The sound of a WAV file of 16-bit PCM; None of another file.

    Raises:
        ValueError: it is too long, or has an odd rate.
    """
    try:
        with wave.open(file, "rb") as read:
            channels, rate = read.getnchannels(), read.getframerate()
            if read.getsampwidth() != 2:
                return None
            _check_length(read.getnframes(), rate)
            data = read.readframes(read.getnframes())
    except (wave.Error, EOFError):
        return None
    whole = len(data) // (2 * channels)
    samples = np.frombuffer(data, "<i2", whole * channels).reshape(whole, channels)
    return Sound(np.ascontiguousarray(samples[:, :2], np.int16), rate)


def _decoded(path: Path) -> Sound:
    """The first sound in a file of any kind.

    Raises:
        InputError: PyAV is missing.
        ValueError: the file holds no sound, is damaged, or is too long.
    """
    try:
        import av  # noqa: PLC0415  # an optional extra
    except ImportError as error:
        raise InputError(
            f"cannot read {path}: sounds other than WAV of 16 bits need the extra: "
            "pip install 'bunraku[video]'"
        ) from error
    try:
        with av.open(str(path)) as container:
            if not container.streams.audio:
                raise ValueError("it holds no sound")
            stream = container.streams.audio[0]
            layout = "mono" if stream.codec_context.channels == 1 else "stereo"
            rate = int(stream.codec_context.sample_rate)
            resampler = av.AudioResampler(format="s16", layout=layout, rate=rate)
            return Sound(_joined(_pieces(container, stream, resampler), rate), rate)
    except av.FFmpegError as error:
        raise ValueError(f"it is no sound ({error.strerror or error})") from error


def _pieces(container: Any, stream: Any, resampler: Any) -> Iterator[Samples]:
    """The samples (S, C) of a stream, piece by piece."""
    for frame in container.decode(stream):
        for piece in resampler.resample(frame):
            yield piece.to_ndarray().reshape(piece.samples, -1)
    for piece in resampler.resample(None):
        yield piece.to_ndarray().reshape(piece.samples, -1)


def _joined(pieces: Iterator[Samples], rate: int) -> Samples:
    """All pieces as one; no more than may be kept are held.

    Raises:
        ValueError: they are too many, or there are none.
    """
    held, count = [], 0
    for piece in pieces:
        held.append(piece)
        count += len(piece)
        _check_length(count, rate)
    if not held:
        raise ValueError("it holds no sound")
    return np.ascontiguousarray(np.concatenate(held), np.int16)


def _check_length(count: int, rate: int) -> None:
    if not RATES[0] <= rate <= RATES[1]:
        raise ValueError(f"it has {rate} samples a second; {RATES[0]} to {RATES[1]} are read")
    if count > LONGEST * rate:
        raise ValueError(f"it is longer than {LONGEST / 60:.0f} minutes; cut it first")
