"""Finds the unit of time stamps that a file does not name, from the usual step between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_UNITS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
_LONGEST = 3.0  # [s] that a frame lasts; a greater step has a smaller unit


def units_per_second(stamps: Array, rate: float | None, notes: list[str]) -> float:
    """Return how many units of the stamps are a second; a note says so if it is not 1.

    Args:
        stamps: (T,) of the frames, finite, of any unit.
        rate: frames per second, if known: the unit nearest to it is taken.
        notes: a guess is added.
    """
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    if not len(steps):
        return 1.0
    step = float(np.median(steps))
    if rate is not None:
        name = min(_UNITS, key=lambda unit: abs(np.log(step / _UNITS[unit] * rate)))
    else:
        name = next((n for n, unit in _UNITS.items() if step / unit < _LONGEST), "nanoseconds")
    if name != "seconds":
        notes.append(f"times are taken as {name} (--fps-input N)")
    return _UNITS[name]


def count_frames(stamps: Array) -> bool:
    """Whether stamps of an unknown unit rise by exactly 1: no camera takes a picture a second."""
    steps = np.diff(stamps)
    return len(steps) > 1 and bool((steps == 1.0).mean() > 0.9)
