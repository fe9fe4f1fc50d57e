"""Shifts the hips of a character over its planted feet, so that no leg has to bend for them.

Hips that travel as the performer's do would drag the feet of a body with other proportions over the
floor: wide hips swing the legs further, a long shin takes longer steps. Where legs point as the
performer's do and a foot stays in its place, it is the hips that are elsewhere. So they move by as
much as the planted feet would slide, and come back slowly. What the performer's own feet do on the
floor, and the noise of their places, moves no hips.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

BACK = 0.25  # [1/s] how fast hips come back from a small shift
FAR = 0.12  # leg lengths: from here on they come back four times as fast, and so on by the square
FARTHEST = 0.4  # leg lengths
LONGEST = 0.25  # [s] between two frames: after a longer gap hips start anew
NONE, ANKLE, TOES = -1, 0, 1


@dataclass(frozen=True, slots=True, eq=False)
class HipShiftState:
    """The memory of a `HipShift` at one moment.

    Attributes:
        shift: (2,) [m] along x and z.
        parts: (F,) the part of each foot that stood: `ANKLE`, `TOES` or `NONE`.
        gaps: (F, 2) [m] along x and z from that part of the performer's foot to the character's.
        time: [s] of the newest frame; NaN before the first.
    """

    shift: Array
    parts: Ints
    gaps: Array
    time: float


class HipShift:
    """The shift of the hips of a character with F legs.

    Args:
        legs: (F,) [m] length of the character's legs from hip to ankle.
    """

    def __init__(self, legs: Array) -> None:
        self._leg = float(np.mean(legs)) if len(legs) else 1.0
        self._shift = np.zeros(2)
        self._parts = np.full(len(legs), NONE)
        self._gaps = np.zeros((len(legs), 2))
        self._time = math.nan

    def reset(self) -> None:
        """Forget all frames."""
        self._time = math.nan

    def snapshot(self) -> HipShiftState:
        """Return a copy of what the next frame depends on."""
        return HipShiftState(self._shift.copy(), self._parts.copy(), self._gaps.copy(), self._time)

    def restore(self, state: HipShiftState) -> None:
        """Go back to a snapshot of as many feet."""
        self._shift[:], self._parts[:] = state.shift, state.parts
        self._gaps[:], self._time = state.gaps, state.time

    def follow(self, points: Array, performer: Array, stands: Bools, time: float) -> Array:
        """Take in a frame; return the shift (2,) [m] along x and z.

        Args:
            points: (F, 2, 3) [m] the character's ankles and toes on the stage, its hips not
                shifted.
            performer: (F, 2, 3) [m] the performer's, brought to the stage as the travel of the
                hips is: turned and scaled.
            stands: (F, 2) whether the performer's ankles and toes stand; see `FootContacts`.
            time: [s]. If it steps back or leaps ahead, or is NaN, the hips start anew.
        """
        dt = time - self._time
        if not 0.0 <= dt <= LONGEST:  # also before the first frame
            self._shift[:], self._parts[:], dt = 0.0, NONE, 0.0
        self._time = time
        _follow(self._shift, self._parts, self._gaps, points, performer, stands, self._leg, dt)
        return self._shift.copy()


@kernel
def _follow(
    shift: Array,
    parts: Ints,
    gaps: Array,
    points: Array,
    performer: Array,
    stands: Bools,
    leg: float,
    dt: float,
) -> None:
    count, x, z = 0, 0.0, 0.0
    for foot in range(len(points)):
        part = TOES if stands[foot, TOES] else ANKLE if stands[foot, ANKLE] else NONE
        stayed = part != NONE and part == parts[foot]
        parts[foot] = part
        if part == NONE:
            continue
        gap_x = points[foot, part, 0] - performer[foot, part, 0]
        gap_z = points[foot, part, 2] - performer[foot, part, 2]
        if stayed:
            count += 1
            x += gaps[foot, 0] - gap_x
            z += gaps[foot, 1] - gap_z
        gaps[foot, 0], gaps[foot, 1] = gap_x, gap_z
    if count > 0:
        shift[0] += x / count
        shift[1] += z / count
    far = math.hypot(shift[0], shift[1])
    share = far / (FAR * leg)
    back = math.exp(-BACK * (1.0 + 3.0 * share * share) * dt)
    back = min(back, FARTHEST * leg / max(far, 1e-12))
    shift[0] *= back
    shift[1] *= back
