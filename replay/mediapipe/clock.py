"""The times of frames [s], from stamps of a known or unknown unit, frame numbers, or a rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.mediapipe.moments import LandmarkText

Array = NDArray[np.float64]

USUAL_RATE = 30.0
_UNITS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
_LONGEST = 3.0  # [s] that a frame lasts; a greater step has a smaller unit
_MOST_FRAME = 1e9


def frame_times(text: LandmarkText) -> Array:
    """Return the time (T,) [s] of each moment, never falling; assumptions become notes."""
    stamps = [moment.time for moment in text.moments]
    known = np.array([np.nan if stamp is None else stamp for stamp in stamps], dtype=np.float64)
    if not np.isfinite(known).all() or _counts_frames(known, text):
        return _from_numbers(text)
    if (np.diff(known) < 0).any():
        text.notes.append("times go back; those frames get the time before")
    known = np.maximum.accumulate(known)
    times: Array = (known - known[0]) / (text.second or _second(known, text))
    return times


def _counts_frames(stamps: Array, text: LandmarkText) -> bool:
    """Whether stamps of no known unit rise by exactly 1: no camera takes a picture a second."""
    steps = np.diff(stamps)
    return text.second is None and len(steps) > 1 and bool((steps == 1.0).mean() > 0.9)


def _second(stamps: Array, text: LandmarkText) -> float:
    """How many of their unit are a second, told from the usual step and the rate, if known."""
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    if not len(steps):
        return 1.0
    step = float(np.median(steps))
    if text.rate is not None:
        rate = text.rate
        name = min(_UNITS, key=lambda unit: abs(np.log(step / _UNITS[unit] * rate)))
    else:
        name = next((n for n, u in _UNITS.items() if step / u < _LONGEST), "nanoseconds")
    if name != "seconds":
        text.notes.append(f"times are taken as {name} (--fps-input N)")
    return _UNITS[name]


def _from_numbers(text: LandmarkText) -> Array:
    """Times from the frames' numbers, or else their order, at the rate of the file."""
    rate = text.rate
    if rate is None:
        rate = USUAL_RATE
        text.notes.append(
            f"times are missing; {rate:.0f} frames a second are assumed (--fps-input N)"
        )
    given = [moment.frame for moment in text.moments]
    numbers = np.array([np.nan if number is None else number for number in given], dtype=np.float64)
    usable = np.isfinite(numbers).all() and (np.abs(numbers) < _MOST_FRAME).all()
    if not usable or (np.diff(numbers) <= 0).any():
        numbers = np.arange(len(numbers), dtype=np.float64)
    times: Array = (numbers - numbers[0]) / rate
    return times
