"""What a deformation solver remembers from one frame to the next, as one immutable value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.deform.creases import CreasesState
from solvers.deform.handle_influence import HandleInfluenceState
from solvers.deform.handles import Handles
from solvers.deform.rest_pose_trials import RestPoseTrials
from solvers.linear.laplacian import Floats


@dataclass(frozen=True, slots=True, eq=False)
class DeformationState:
    """The state of an `ArapSolver` or a `SquashStretchSolver` of N vertices between two frames.

    The state holds which handles are held, and how firmly, because goals and influences refer to
    them. The factor is a function of the handles and of its precision: `restore` factors again
    where they differ. Settings (elasticity, stiffness, regions) are no part of the state.

    Attributes:
        positions: (N, 3) the last answer, in the solver's order and unit.
        rotations: (N, 9) the cells' matrices after the last iteration, with their scales.
        handles: the handles that were held.
        goals: (H, 3) their targets in the last solve.
        precision: the type of the factor's numbers; it depends on earlier handles.
        influence: which groups the vertices follow, and how far the search for them had come.
        trials: when the rest pose is tried next.
        creases: the folded triangles; None before the first were looked for.
        cell_scales: (N,) the scales in `rotations`; None where the cells do not scale.
    """

    positions: Floats
    rotations: Floats
    handles: Handles
    goals: Floats
    precision: np.dtype[Any]
    influence: HandleInfluenceState
    trials: RestPoseTrials
    creases: CreasesState | None
    cell_scales: Floats | None = None
