"""Mixes the sound of a session: a function of the session and the time alone, like its pictures."""

from __future__ import annotations

import math
import wave
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import resample_poly

from runtime.output.files.whole_file import writing
from runtime.session.document import Session
from runtime.sound.sound import Samples, Sound

RATE = 48_000  # samples a second of the mix, which has two channels
SOFT = 0.005  # [s] in which a sound comes and goes, so that it does not click

Mixed = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """A sound at a place of the session's time.

    Attributes:
        samples: (S, 2) at `RATE`, all of the sound.
        start: [s] of the session's time.
        first, last: [s] of the sound that are heard.
    """

    samples: Samples
    start: float
    first: float
    last: float


def for_mixing(sound: Sound) -> Samples:
    """Return the samples (S, 2) of a sound at `RATE`."""
    samples: Samples = np.repeat(sound.samples, 2 // sound.samples.shape[1], axis=1)
    if sound.rate == RATE:
        return samples
    common = math.gcd(sound.rate, RATE)
    even = resample_poly(samples.astype(np.float32), RATE // common, sound.rate // common, axis=0)
    whole: Samples = np.clip(np.rint(even), -(1 << 15), (1 << 15) - 1).astype(np.int16)
    return whole


def heard_in(session: Session, samples_of: Callable[[str], Samples | None]) -> list[Heard]:
    """Return what is heard of a session.

    A take's sound is cut, moved and played again with its clips, as its motion is. It is silent
    where a clip is muted or beside a solo, and where a clip is slower or faster than its take.

    Args:
        session: what plays.
        samples_of: gives the samples (S, 2) at `RATE` of a sound's file; None of one that is lost.
    """
    heard = []
    for clip, take in (pair for actor in session.actors for pair in session.played(actor.id)):
        samples = samples_of(take.sound) if take.sound and clip.speed == 1.0 else None
        if samples is None:
            continue
        span = clip.last - clip.first
        for number in range(math.ceil(clip.passes)):
            part = min(clip.passes - number, 1.0) * span
            start = clip.start + number * span
            heard.append(Heard(samples, start, clip.first, clip.first + part))
    return heard


def mixed(heard: Sequence[Heard], start: int, count: int) -> Mixed:
    """Return samples (count, 2) in [-1, 1], from a sample of the session's time on."""
    total = np.zeros((count, 2), np.float32)
    soft = round(SOFT * RATE)
    for one in heard:
        begins, source = round(one.start * RATE), round(one.first * RATE)
        length = min(round(one.last * RATE), len(one.samples)) - source
        low, high = max(start, begins), min(start + count, begins + length)
        if low >= high:
            continue
        place = np.arange(low - begins, high - begins)
        share = np.clip(np.minimum(place + 1, length - place) / soft, 0.0, 1.0)
        part = one.samples[source + low - begins : source + high - begins]
        total[low - start : high - start] += part * (share[:, None] / (1 << 15)).astype(np.float32)
    return np.clip(total, -1.0, 1.0)


def write_mix(path: Path, heard: Sequence[Heard], start: float, seconds: float) -> None:
    """Write a range of the mix as a WAV file of 16-bit PCM.

    Args:
        path: of the file.
        heard: what is heard.
        start: [s] of the session's time.
        seconds: how long the range is [s].

    Raises:
        InputError: the disk fails.
    """
    with writing(path), wave.open(str(path), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(RATE)
        for first, count in _seconds(round(start * RATE), round(seconds * RATE)):
            samples = np.rint(mixed(heard, first, count) * ((1 << 15) - 1)).astype("<i2")
            file.writeframes(samples.tobytes())


def _seconds(start: int, count: int) -> Iterator[tuple[int, int]]:
    """A range of samples in pieces of a second."""
    return ((at, min(RATE, start + count - at)) for at in range(start, start + count, RATE))
