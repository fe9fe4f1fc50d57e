"""The times of frames [s], from stamps of a known or unknown unit, frame numbers, or a rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.mediapipe.moments import LandmarkText
from replay.stamps import count_frames, units_per_second

Array = NDArray[np.float64]

USUAL_RATE = 30.0
_MOST_FRAME = 1e9


def frame_times(text: LandmarkText) -> Array:
    """Return the time (T,) [s] of each moment, never falling; assumptions become notes."""
    stamps = [moment.time for moment in text.moments]
    known = np.array([np.nan if stamp is None else stamp for stamp in stamps], dtype=np.float64)
    if not np.isfinite(known).all() or (text.second is None and count_frames(known)):
        return _from_numbers(text)
    if (np.diff(known) < 0).any():
        text.notes.append("times go back; those frames get the time before")
    known = np.maximum.accumulate(known)
    second = text.second or units_per_second(known, text.rate, text.notes)
    times: Array = (known - known[0]) / second
    return times


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
