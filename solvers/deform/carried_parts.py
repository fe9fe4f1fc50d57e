"""Parts of a surface without handles: the nearest group of handles carries each of them rigidly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.deform.arap_layout import Layout
from solvers.deform.handle_motion import Influences, fit_motions, follow, follow_one_group
from solvers.deform.handles import Handles, nearest_groups, unheld
from solvers.linear.constrained_system import Constraints
from solvers.linear.laplacian import Floats, Ints


@dataclass(frozen=True, slots=True, eq=False)
class CarriedParts:
    """Components without a handle, and vertices without a face.

    Attributes:
        places: (C,) their vertices, in the solver's order.
        carriers: the one group that each vertex follows.
    """

    places: Ints
    carriers: Influences

    @classmethod
    def of(cls, rest: Floats, handles: Handles, layout: Layout) -> CarriedParts:
        """Find the parts of a surface with rest positions (N, 3) that no handle touches."""
        places = unheld(handles, layout)
        return cls(places, follow_one_group(nearest_groups(rest, places, handles, layout.parts)))

    def constraints(self, handles: Handles, count: int, unit: float) -> Constraints:
        """Return the constraints of `count` vertices by handles and carried parts.

        A soft handle of weight 1 is a spring of stiffness `unit`.
        """
        fixed = np.zeros(count, dtype=np.bool_)
        fixed[self.places] = True
        fixed[handles.places[handles.hard]] = True
        stiffness = np.zeros(count)
        stiffness[handles.places] = np.where(handles.hard, 0.0, handles.weights) * unit
        return Constraints(fixed, stiffness)

    def move(self, rest: Floats, handles: Handles, goals: Floats, x: Floats) -> None:
        """Move the parts in x (N, 3) rigidly from rest, as the handles move to `goals` (H, 3)."""
        if len(self.places):
            whole = fit_motions(rest[handles.places], goals, handles.group_of, handles.count)
            moved = np.empty((len(self.places), 3))
            follow(rest[self.places], self.carriers, whole, moved)
            x[self.places] = moved
