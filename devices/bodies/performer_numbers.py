"""Assign stable performer numbers to bodies whose sensor ids change.

A sensor's slots are not identities, and its ids change when a person is lost for a moment. An id
keeps its number. A body with a new id takes the free number whose last body was lost nearest to
it, otherwise the lowest free number.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME_BODY = 0.6  # [m] at most between the place where an id was lost and the place of a new one


class PerformerNumbers:
    """The performer number of each body, from frame to frame."""

    def __init__(self) -> None:
        self._ids: list[int] = []  # the last id with each number
        self._places: list[Array] = []

    def __call__(self, bodies: Mapping[int, Array]) -> dict[int, int]:
        """Return the number of each body of one frame.

        Args:
            bodies: position (3,) [m] of each body by the sensor's id; NaN where unknown.
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
