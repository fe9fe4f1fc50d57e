"""The path of a character on the stage: its heading, and how far its hips have travelled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.targets import Placement
from solvers.retarget.heading import turned

Array = NDArray[np.float64]

_ORIGIN = np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Where a character is at one moment, as its hips follow the performer's.

    Attributes:
        turn: [rad] about the vertical, from rest.
        about: (3,) [m] the point at rest about which a placement turns.
        hips: (3,) [m] the middle of the character's hips at rest.
        posed: (3,) [m] the same in the posed body, before the placement.
        origin: (3,) [m] where the middle of the performer's hips was when the path began.
        course: [rad] from the performer's way to the character's.
        ratio: the character's way for each metre of the performer's.
        performer: (3,) [m] where the middle of the performer's hips is.
        shift: (2,) [m] along x and z, by which the character's hips are off that way.
    """

    turn: float
    about: Array
    hips: Array
    posed: Array
    origin: Array
    course: float
    ratio: float
    performer: Array
    shift: Array

    def performer_on_stage(self, points: Array) -> Array:
        """Take points (..., 3) [m] of the performer to the stage, their heights only scaled."""
        way = turned((points - self.origin).reshape(-1, 3), self.course, _ORIGIN)
        placed = self.ratio * way + (self.hips[0], 0.0, self.hips[2])
        return placed.reshape(points.shape)

    def on_stage(self, points: Array) -> Array:
        """Take points (..., 3) [m] of the character to the stage, without regard to the floor."""
        placed = turned(points.reshape(-1, 3), self.turn, self.hips) + self._travel
        return placed.reshape(points.shape)

    def off_stage(self, points: Array) -> Array:
        """The inverse of `on_stage`."""
        back = turned((points - self._travel).reshape(-1, 3), -self.turn, self.hips)
        return back.reshape(points.shape)

    def placement(self, clearance: float) -> Placement:
        """The placement that does this, with the lowest vertex `clearance` [m] above the floor."""
        back = self.hips - turned(self.hips[None], self.turn, self.about)[0]
        x, _, z = back + self._travel
        return Placement(self.turn, (float(x), float(z)), clearance=clearance)

    @property
    def _travel(self) -> Array:
        place = self.performer_on_stage(self.performer[None])[0]
        way: Array = place - turned(self.posed[None], self.turn, self.hips)[0]
        way[0] += self.shift[0]
        way[1] = 0.0
        way[2] += self.shift[1]
        return way
