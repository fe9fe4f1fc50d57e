"""Sounds of clicks at stated moments, and where the clicks of a sound are."""

from __future__ import annotations

import wave
from pathlib import Path

import numpy as np

from runtime.sound.sound import Sound

RATE = 48_000


def clicks(*moments: float, seconds: float = 3.0, rate: int = RATE, channels: int = 1) -> Sound:
    """Silence with clicks of 2 ms."""
    samples = np.zeros((round(seconds * rate), channels), np.int16)
    for moment in moments:
        samples[round(moment * rate) : round((moment + 0.002) * rate)] = 20_000
    return Sound(samples, rate)


def moments_of(samples: np.ndarray, rate: int = RATE) -> list[float]:
    """When a click begins in samples (S,) in [-1, 1], to a millisecond."""
    loud = np.flatnonzero(np.abs(samples) > 0.25)
    first = np.diff(loud, prepend=-rate) > rate // 50
    return [round(float(at) / rate, 3) for at in loud[first]]


def moments_in_wav(path: Path) -> list[float]:
    """The same of a WAV file of 16-bit PCM, as the standard library reads it."""
    with wave.open(str(path), "rb") as file:
        data = np.frombuffer(file.readframes(file.getnframes()), "<i2")
        return moments_of(data[:: file.getnchannels()] / 32768.0, file.getframerate())


def moments_in_video(path: Path) -> tuple[list[float], list[float]]:
    """When clicks are heard and when pictures are shown, as PyAV plays a video [s]."""
    import av

    pieces, begins = [], []
    with av.open(str(path)) as container:
        for frame in container.decode(audio=0):
            begins.append(float(frame.pts * frame.time_base))
            pieces.append(frame.to_ndarray()[0])
            rate = frame.sample_rate
    with av.open(str(path)) as container:
        pictures = [float(each.pts * each.time_base) for each in container.decode(video=0)]
    heard = moments_of(np.concatenate(pieces), rate)
    return [round(begins[0] + moment, 3) for moment in heard], pictures
