"""Puts a deformed character on the stage: turned, moved, lifted, and kept above the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.targets import Placement, PosedNodes
from solvers.retarget.ground_contact import place_above_floor, place_on_floor, turned_rotations
from solvers.retarget.heading import turned

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """The rigid motion that puts a character on the stage.

    Attributes:
        turn: [rad] about the vertical through `about`.
        about: (3,) [m].
        shift: (3,) [m] after the turn; contact with the floor is part of it.
    """

    turn: float
    about: Array
    shift: Array

    def place(self, points: Array) -> Array:
        """Return points (n, 3) [m] of the character on the stage."""
        return turned(points, self.turn, self.about) + self.shift

    def place_nodes(self, nodes: PosedNodes) -> PosedNodes:
        """Return nodes of the character on the stage."""
        rotations = turned_rotations(nodes.rotations, self.turn)
        return PosedNodes(self.place(nodes.positions), rotations)


def put_on_stage(vertices: Array, placement: Placement, about: Array, out: Array) -> Stance:
    """Put vertices (N, 3) [m] on the stage, into `out` (N, 3); nothing sinks into the floor.

    With a clearance, the lowest vertex stands that high above the floor: who stands stays on the
    floor while the legs bend. Else the character is lifted, by the floor where it must be.

    Args:
        vertices: of the character, before the placement.
        placement: where the whole character is.
        about: (3,) [m] the root node at rest.
        out: where they are put; not `vertices` itself.
    """
    x, z = placement.travel
    if placement.clearance is None:
        rise = place_on_floor(vertices, placement.turn, about, placement.lift, out)
    else:
        rise = place_above_floor(vertices, placement.turn, about, placement.clearance, out)
    if x != 0.0 or z != 0.0:
        out += (x, 0.0, z)
    return Stance(placement.turn, about, np.array([x, rise, z]))
