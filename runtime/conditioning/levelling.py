"""Finds the floor from where the feet have stood, and brings it to y = 0.

Adapters of devices that see the floor, or measure their own tilt, have levelled their frames
already (`devices.bodies.camera_level`); the correction here is then small.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.conditioning.body_anatomy import BodyAnatomy
from solvers.kernels.compiled import kernel
from solvers.kernels.short_loops import put
from solvers.signal.floor_plane import FloorFit, FloorState, upright
from solvers.skeleton.quaternions import followed_by

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

EVERY, LONGEST = 0.1, 0.5  # [s] between two looks at the feet
STILL = 0.25  # [m/s] a standing foot is slower
LOWEST = 0.05  # [m] a standing foot is no higher above the lowest one
JUMPED = 0.15  # [m] a foot this far above the known floor is in the air
KNOWN = 1.0  # [s] of standing after which the floor is known

# Of each foot: its joint, and the joint's height above the floor in standing; its place at the last
# look, and whether it stood still since the look before.
_FOOT = np.dtype(
    [
        ("joint", np.int64),
        ("rest", np.float64),
        ("place", np.float64, 3),
        ("still", np.bool_),
    ],
    align=True,
)


@dataclass(frozen=True, slots=True, eq=False)
class LevellingState:
    """What is known of a floor.

    Attributes:
        feet: (F,) of `_FOOT`.
        fit: the plane under the feet.
        at: [s] the last look at the feet.
        turn: (3, 3) rotation that makes the floor level.
        rise: [m] that then brings it to y = 0.
    """

    feet: Records
    fit: FloorState
    at: float
    turn: Array
    rise: float


class Levelling:
    """Finds the floor of one stream and brings it to y = 0.

    Args:
        body: the skeleton's anatomy.
    """

    def __init__(self, body: BodyAnatomy) -> None:
        self._feet = np.zeros(len(body.feet), _FOOT)
        self._feet["joint"], self._feet["rest"] = body.feet, body.feet_rest
        self._fit = FloorFit()
        self._at = float("nan")
        self._turn, self._rise = np.eye(3), 0.0

    def forget(self) -> None:
        """Measure the floor anew; the last correction stays until the next step."""
        self._fit = FloorFit()

    def snapshot(self) -> LevellingState:
        """Return a copy of what is known of the floor."""
        feet, fit, turn = self._feet.copy(), self._fit.snapshot(), self._turn.copy()
        return LevellingState(feet, fit, self._at, turn, self._rise)

    def restore(self, state: LevellingState) -> None:
        """Go back to a snapshot."""
        self._feet[:], self._at = state.feet, state.at
        self._fit.restore(state.fit)
        self._turn, self._rise = state.turn.copy(), state.rise

    def watch(self, positions: Array, filled: Bools, time: float) -> None:
        """Learn the floor from positions (J, 3) [m]; joints `filled` (J,) are guesses."""
        elapsed = time - self._at
        if 0.0 <= elapsed < EVERY or not len(self._feet):
            return
        self._at = time
        reach = STILL * elapsed if 0.0 < elapsed < LONGEST else 0.0
        soles = _standing(self._feet, positions, filled, reach)
        if self._fit.weight > KNOWN:
            soles = soles[self.level(soles)[:, 1] < JUMPED]
        if len(soles):
            self._fit.add(soles, elapsed)
            self._correct(*self._fit.plane())

    def level(self, positions: Array) -> Array:
        """Positions (J, 3) [m] with the floor at y = 0."""
        return _levelled(positions, self._turn, self._rise)

    def level_rotations(self, rotations: Array) -> Array:
        """World rotations (J, 4), turned as the positions are; NaN stays NaN."""
        known = np.isfinite(rotations.sum(axis=1))
        return followed_by(rotations, self._turn, known=known)

    def _correct(self, a: float, b: float, height: float) -> None:
        """Let the correction bring y = a x + b z + height to y = 0, turning about the origin."""
        upward = 1.0 / math.sqrt(1.0 + a * a + b * b)
        self._turn = upright(np.array([-a, 1.0, -b]) * upward)
        self._rise = -height * upward


@kernel
def _standing(feet: Records, positions: Array, filled: Bools, reach: float) -> Array:
    """The soles (n, 3) [m] that moved by less than `reach` [m] and are not in the air."""
    soles = np.empty((len(feet), 3))
    for index, foot in enumerate(feet):
        place = positions[foot.joint]
        foot.still = ((place - foot.place) ** 2).sum() < reach**2 and not filled[foot.joint]
        put(foot.place, place)
        put(soles[index], place)
        soles[index, 1] -= foot.rest
    lowest = soles[:, 1].min()
    count = 0
    for index, foot in enumerate(feet):
        if foot.still and soles[index, 1] < lowest + LOWEST:
            put(soles[count], soles[index])
            count += 1
    return soles[:count]


@kernel
def _levelled(points: Array, turn: Array, rise: float) -> Array:
    out = np.empty_like(points)
    for index in range(len(points)):
        x, y, z = points[index]
        for axis in range(3):
            out[index, axis] = turn[axis, 0] * x + turn[axis, 1] * y + turn[axis, 2] * z
        out[index, 1] += rise
    return out
