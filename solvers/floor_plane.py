"""The floor under somebody's feet, as a plane fitted to where they stood.

Least squares with forgetting: only six sums are kept. A small penalty on the slope keeps the floor
level as long as the feet have stood at one place only, where any slope would fit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEMORY = 10.0  # [s] after which a step counts half
STIFFNESS = 0.5  # [s m^2] of standing a metre away that tilts as much as the level floor holds
STEEPEST = 0.6  # slope, about 30 degrees; what is steeper was no floor


class FloorFit:
    """A plane y = a x + b z + c through points that come one by one.

    Attributes:
        weight: [s] of standing that is remembered.
    """

    def __init__(self) -> None:
        self._normal = np.zeros((3, 3))
        self._right = np.zeros(3)
        self.weight = 0.0

    def add(self, points: Array, dt: float) -> None:
        """Take in where feet stood (n, 3) [m] for `dt` [s]."""
        keep = 0.5 ** (dt / MEMORY)
        rows = np.column_stack([points[:, 0], points[:, 2], np.ones(len(points))])
        self._normal = keep * self._normal + dt * rows.T @ rows
        self._right = keep * self._right + dt * rows.T @ points[:, 1]
        self.weight = keep * self.weight + dt * len(points)

    def plane(self) -> tuple[float, float, float]:
        """The slopes along x and z and the height [m] at the origin; level at 0 before any step."""
        if self.weight <= 0.0:
            return 0.0, 0.0, 0.0
        middle = self._normal[2, :2] / self.weight
        height = self._right[2] / self.weight
        spread = self._normal[:2, :2] - self.weight * np.outer(middle, middle)
        rise = self._right[:2] - middle * self._right[2]
        slope = np.linalg.solve(spread + STIFFNESS * np.eye(2), rise)
        slope *= min(1.0, STEEPEST / max(float(np.linalg.norm(slope)), STEEPEST))
        return float(slope[0]), float(slope[1]), float(height - slope @ middle)
