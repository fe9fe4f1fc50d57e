"""Constant ids for the people in a film, whose order changes from picture to picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FARTHEST = 0.25  # widths of the picture that a person moves from one picture to the next at most


class PeopleIds:
    """The id of each person, from picture to picture: the nearest before keeps it."""

    def __init__(self) -> None:
        self._next = 0
        self._places: dict[int, Array] = {}

    def __call__(self, places: Sequence[Array]) -> list[int]:
        """Return the id of each person.

        Args:
            places: (2,) place of each person [widths of the picture].
        """
        steps = sorted(
            (float(np.linalg.norm(place - before)), row, known)
            for row, place in enumerate(places)
            for known, before in self._places.items()
        )
        ids: dict[int, int] = {}
        for step, row, known in steps:
            if step < FARTHEST and row not in ids and known not in ids.values():
                ids[row] = known
        for row in range(len(places)):
            if row not in ids:
                ids[row] = self._next
                self._next += 1
        self._places = {ids[row]: place for row, place in enumerate(places)}
        return [ids[row] for row in range(len(places))]
