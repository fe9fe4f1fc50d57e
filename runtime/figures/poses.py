"""The poses of the figures: handles at a character's foot and top, and their targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from devices.errors import InputError
from runtime.characters.character import Character
from solvers.arap import ArapSolver
from solvers.linear.laplacian import Floats, Ints

_PATCH = 0.1  # of the height, at the foot and at the top
_ITERATIONS = 3  # a frame, as in the paper
_FRAMES, _WAIT = 24, 24


@dataclass(frozen=True, slots=True, eq=False)
class Press:
    """Handles (H,) at the foot (group 0) and at the top (group 1) of a character."""

    rest: Floats
    handles: Ints
    groups: Ints

    @classmethod
    def on(cls, character: Character) -> Press:
        """Choose the handles of a character.

        Raises:
            InputError: the character is too flat or too coarse to have a foot and a top.
        """
        height = character.vertices[:, 1]
        low, high = float(height.min()), float(height.max())
        cut = _PATCH * (high - low)
        handles = np.flatnonzero((height <= low + cut) | (height >= high - cut))
        if high - low < 1e-6 or len(handles) == len(height):
            raise InputError(
                f"{character.name}: nothing is left between its foot and its top; "
                "use a finer mesh, or one that stands upright"
            )
        groups = (height[handles] > 0.5 * (low + high)).astype(np.int64)
        return cls(character.vertices, handles, groups)

    def targets(self, ratio: float, lean: float) -> Floats:
        """Return targets (H, 3) [m]: the top at `ratio` of its height, leaning by `lean` [rad]."""
        targets = self.rest[self.handles].copy()
        upper = self.groups == 1
        foot = self.rest[self.handles[~upper]].mean(axis=0)
        turn = Rotation.from_rotvec([0.0, 0.0, -lean])
        middle = targets[upper].mean(axis=0)
        place = foot + turn.apply((middle - foot) * [1.0, ratio, 1.0])
        targets[upper] = turn.apply(targets[upper] - middle) + place
        return targets


def perform(solver: ArapSolver, press: Press, ratio: float, lean: float) -> Floats:
    """Move the handles to the pose in frames, as in a performance; return vertices (N, 3) [m]."""
    for share in [*np.linspace(0.0, 1.0, _FRAMES), *np.ones(_WAIT)]:
        targets = press.targets(1.0 + share * (ratio - 1.0), share * lean)
        answer = solver.solve(targets, _ITERATIONS)
    return answer
