"""The output of a driver for one frame: a placement and targets for the surface of a character."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SKIN_FIRMNESS = 0.02  # measured: see docs/deformation.md


@dataclass(frozen=True, slots=True)
class Placement:
    """Where the whole character is, relative to its rest pose.

    Attributes:
        turn: [rad] about the vertical through the root node.
        travel: [m] along x and z, after the turn.
        lift: [m] along y. Contact with the floor may lift the character further.
        clearance: [m] of the character's lowest vertex above the floor, whatever the lift; None
            for the lift.
    """

    turn: float = 0.0
    travel: tuple[float, float] = (0.0, 0.0)
    lift: float = 0.0
    clearance: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class HandleGroups:
    """H handles of a deformable surface of C vertices; each group moves rigidly.

    Attributes:
        vertices: (H,) vertex of the deformed surface (`DeformableSurface.rest`), each once.
        group_of: (H,) group of each handle, 0 to G - 1.
    """

    vertices: Indices
    group_of: Indices

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, HandleGroups):
            return NotImplemented
        return self is other or (
            np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self.group_of, other.group_of)
        )

    def __hash__(self) -> int:
        return hash((len(self.vertices), self.vertices.tobytes()))


@dataclass(frozen=True, slots=True, eq=False)
class HandleTargets:
    """Targets of handles; the solver deforms the surface to meet them.

    Attributes:
        handles: the handles. Where they are others than in the frame before, the solver holds
            these, which costs a few milliseconds.
        positions: (H, 3) [m] target of each handle.
        weights: (G,) how firmly each group is held: see `ArapSolver.hold`.
    """

    handles: HandleGroups
    positions: Array
    weights: Array


@dataclass(frozen=True, slots=True, eq=False)
class SkinnedTargets:
    """Where a skin puts every vertex; the solver starts there, and makes the surface even.

    Attributes:
        positions: (C, 3) [m] of the deformed surface (`DeformableSurface.rest`).
        firmness: how firmly each vertex is held there, above 0: see `ArapSolver.hold`. Another
            firmness than in the frame before costs a few milliseconds.
    """

    positions: Array
    firmness: float = SKIN_FIRMNESS


@dataclass(frozen=True, slots=True, eq=False)
class PosedNodes:
    """The K nodes of a character's skeleton at one moment.

    Attributes:
        positions: (K, 3) [m].
        rotations: (K, 4) quaternions (x, y, z, w), world, from rest.
    """

    positions: Array
    rotations: Array


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """What a driver asks of a character for one frame. Nobody writes to its arrays.

    Attributes:
        shape: targets of handles, or of a skin, or the finished surface: (N, 3) [m] all vertices
            of the character, which the solver then leaves as they are. Before the placement.
        placement: where the whole character is.
        nodes: the posed nodes, before the placement; None if the driver poses none.
    """

    shape: HandleTargets | SkinnedTargets | Array
    placement: Placement = field(default_factory=Placement)
    nodes: PosedNodes | None = None
