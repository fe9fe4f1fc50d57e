"""Fits the plane of the floor to the places where a performer's feet have stood.

Least squares with forgetting keeps only six sums. A small penalty on the slope keeps the floor
level while the feet have stood at one place only, where any slope would fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]

MEMORY = 10.0  # [s] after which a step counts half
STIFFNESS = 0.5  # [s m^2] of standing a metre away that balances the pull to a level floor
STEEPEST = 0.6  # slope, about 30 degrees; a steeper plane is no floor


@dataclass(frozen=True, slots=True, eq=False)
class FloorState:
    """The sums of a floor fit at one moment: normal equations (3, 3), (3,), and weight [s]."""

    normal: Array
    right: Array
    weight: float


class FloorFit:
    """A plane y = a x + b z + c through points that arrive over time.

    Attributes:
        weight: [s] of standing in the sums.
    """

    def __init__(self) -> None:
        self._normal = np.zeros((3, 3))
        self._right = np.zeros(3)
        self.weight = 0.0

    def add(self, points: Array, dt: float) -> None:
        """Add places (n, 3) [m] where feet stood for `dt` [s]."""
        keep = 0.5 ** (dt / MEMORY)
        _add(self._normal, self._right, points, keep, dt)
        self.weight = keep * self.weight + dt * len(points)

    def snapshot(self) -> FloorState:
        """Return a copy of the fit's sums."""
        return FloorState(self._normal.copy(), self._right.copy(), self.weight)

    def restore(self, state: FloorState) -> None:
        """Go back to a snapshot."""
        self._normal[:], self._right[:], self.weight = state.normal, state.right, state.weight

    def plane(self) -> tuple[float, float, float]:
        """Return the slopes along x and z and the height [m] at the origin; zeros at first."""
        if self.weight <= 0.0:
            return 0.0, 0.0, 0.0
        (xx, xz, x), (_, zz, z), _ = self._normal.tolist()
        xy, zy, y = self._right.tolist()
        middle_x, middle_z, middle_y = x / self.weight, z / self.weight, y / self.weight
        xx, xz, zz = xx + STIFFNESS - x * middle_x, xz - x * middle_z, zz + STIFFNESS - z * middle_z
        xy, zy = xy - y * middle_x, zy - y * middle_z
        determinant = xx * zz - xz * xz  # at least STIFFNESS squared
        a, b = (zz * xy - xz * zy) / determinant, (xx * zy - xz * xy) / determinant
        gentle = STEEPEST / max(math.hypot(a, b), STEEPEST)
        a, b = a * gentle, b * gentle
        return a, b, middle_y - a * middle_x - b * middle_z


def upright(axis: Array) -> Array:
    """Return the smallest rotation (3, 3) that carries the unit vector `axis`, not -Y, to +Y."""
    x, y, z = axis
    # Rodrigues' formula about axis x Y, expanded; 1 + y > 0 as the axis does not point down.
    return np.array(
        [
            [1 - x * x / (1 + y), -x, -x * z / (1 + y)],
            [x, y, z],
            [-x * z / (1 + y), -z, 1 - z * z / (1 + y)],
        ]
    )


@kernel
def _add(normal: Array, right: Array, points: Array, keep: float, dt: float) -> None:
    normal *= keep
    right *= keep
    for point in points:
        row = point[0], point[2], 1.0
        for i in range(3):
            right[i] += dt * row[i] * point[1]
            for j in range(3):
                normal[i, j] += dt * row[i] * row[j]
