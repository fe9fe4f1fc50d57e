"""Height of the floor from the lowest joints of a standing body."""

from __future__ import annotations

import numpy as np

REMEMBERED = 150  # heights of lowest joints
STANDING = 5.0  # percentile of them that is the floor: below it, feet were tracked badly


class FloorHeight:
    """A low percentile of the lowest joints' heights."""

    def __init__(self) -> None:
        self._lowest: list[float] = []

    def add(self, lowest: float) -> None:
        """Add the height of the lowest joint in one frame."""
        self._lowest = [*self._lowest[-REMEMBERED + 1 :], lowest]

    @property
    def value(self) -> float:
        """The floor's height in the unit of the added ones; 0 before any."""
        return float(np.percentile(self._lowest, STANDING)) if self._lowest else 0.0
