"""Small numbers for bodies that a sensor knows by ids of its own.

A sensor's slots say nothing, and its ids change when a person was lost for a moment. A number
stays with an id; of a body with a new id it is the free number whose last holder left nearest by,
else the lowest number that is free.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME_BODY = 0.6  # [m] between where one id was lost and another came up, of the same person


class PerformerNumbers:
    """Which number each body has, from frame to frame."""

    def __init__(self) -> None:
        self._ids: list[int] = []  # the last holder of each number
        self._places: list[Array] = []

    def __call__(self, bodies: Mapping[int, Array]) -> dict[int, int]:
        """The number of each body of one frame.

        Args:
            bodies: by the sensor's id, where the body is (3,) [m]; NaN where that is not known.
        """
        numbers = {body: self._ids.index(body) for body in bodies if body in self._ids}
        for body, place in bodies.items():
            if body not in numbers:
                numbers[body] = self._free(place, set(numbers.values()))
        for body, number in numbers.items():
            if number == len(self._ids):
                self._ids.append(body)
                self._places.append(bodies[body])
            self._ids[number] = body
            if np.isfinite(bodies[body]).all():
                self._places[number] = bodies[body]
        return numbers

    def _free(self, place: Array, taken: set[int]) -> int:
        most = len(self._ids) + len(taken) + 1
        free = [number for number in range(most) if number not in taken]
        far = {
            number: float(np.linalg.norm(place - self._places[number]))
            for number in free
            if number < len(self._ids)
        }
        near = {number: distance for number, distance in far.items() if distance < SAME_BODY}
        return min(near, key=near.__getitem__) if near else free[0]
