"""Joints that are believed again go to where they are seen within a moment; they do not jump."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

SECONDS = 0.15
FORGET = 0.5  # [s] without a frame after which nobody remembers where joints were shown
NEARLY = 0.02  # [m] that nobody sees as a jump


class Rejoining:
    """Leads the joints of one performer back from their guessed places.

    Args:
        joints: how many the skeleton has.
    """

    def __init__(self, joints: int) -> None:
        self._off = np.zeros((joints, 3))  # [m] from where it is seen, when it was seen again
        self._since = np.full(joints, -np.inf)
        self._shown: Array | None = None
        self._at = 0.0
        self._filled = np.zeros(joints, dtype=bool)

    def forget(self) -> None:
        """Show whatever comes next where it is."""
        self._shown = None
        self._since[:] = -np.inf

    def lead(self, positions: Array, filled: Bools, time: float) -> tuple[Array, Bools]:
        """Where joints (J, 3) [m] are shown, and which (J,) of them are on their way.

        Args:
            positions: (J, 3) [m], all finite.
            filled: (J,) which of them are guesses.
            time: [s].
        """
        if self._shown is not None and abs(time - self._at) < FORGET:
            again = self._filled & ~filled
            if again.any():
                self._off[again] = self._shown[again] - positions[again]
                far = np.einsum("ij,ij->i", self._off, self._off) > NEARLY**2
                self._since[again] = np.where(far[again], time, -np.inf)
        passed = (time - self._since) / SECONDS
        on_the_way = (passed >= 0.0) & (passed < 1.0) & ~filled
        if on_the_way.any():
            left = 1.0 - np.where(on_the_way, passed, 1.0)
            positions = positions + self._off * (left * left * (3.0 - 2.0 * left))[:, None]
        self._shown, self._filled, self._at = positions, filled, time
        return positions, on_the_way
