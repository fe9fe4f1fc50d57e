"""The floor brought to y = 0, by where the feet have stood.

Devices that see the floor themselves, or feel how they are tilted, have levelled their frames
already (`devices.floor_level`); then there is little left to do here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.orientation import upright
from runtime.conditioning.body import Body
from solvers.floor_plane import FloorFit

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

EVERY, LONGEST = 0.1, 0.5  # [s] between two looks at the feet
STILL = 0.25  # [m/s] a foot that stands is slower
LOWEST = 0.05  # [m] and no higher above the lowest foot
JUMPED = 0.15  # [m] above the floor as known, where a foot is in the air
KNOWN = 1.0  # [s] of standing after which the floor is known


class Levelling:
    """Finds the floor of one stream and brings it to y = 0.

    Args:
        body: the skeleton's anatomy.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self._fit = FloorFit()
        self._feet: Array | None = None
        self._at = 0.0
        self._turn, self._rise = np.eye(3), 0.0

    def forget(self) -> None:
        """Look for the floor anew, from the next step on; until then it stays."""
        self._fit = FloorFit()

    def watch(self, positions: Array, filled: Bools, time: float) -> None:
        """Learn from where the feet are: (J, 3) [m], and (J,) which of them are guesses."""
        feet = self._body.feet
        if not len(feet):
            return
        before, elapsed = self._feet, time - self._at
        if before is not None and 0.0 <= elapsed < EVERY:
            return
        self._feet, self._at = positions[feet], time
        if before is None or not 0.0 < elapsed < LONGEST:
            return
        move = self._feet - before
        still = np.einsum("ij,ij->i", move, move) < (STILL * elapsed) ** 2
        soles = self._feet - self._body.feet_rest[:, None] * [0.0, 1.0, 0.0]
        stands = still & ~filled[feet] & (soles[:, 1] < soles[:, 1].min() + LOWEST)
        if self._fit.weight > KNOWN:
            stands &= (soles @ self._turn.T)[:, 1] + self._rise < JUMPED
        if stands.any():
            self._fit.add(soles[stands], elapsed)
            self._hold(*self._fit.plane())

    def level(self, positions: Array) -> Array:
        """Positions (J, 3) [m] with the floor at y = 0."""
        out: Array = positions @ self._turn.T
        out[:, 1] += self._rise
        return out

    def _hold(self, a: float, b: float, height: float) -> None:
        """Bring y = a x + b z + height to y = 0, turning about the origin."""
        normal = np.array([-a, 1.0, -b])
        normal /= np.linalg.norm(normal)
        self._turn = upright(normal)
        self._rise = -height * float(normal[1])
