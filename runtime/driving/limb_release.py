"""Softens the handles of a limb while its joints are not seen, and firms them again afterwards.

The fill stage (`replay.fill`) keeps an unseen joint where it was, then moves it to rest. When the
joint is seen again, it jumps. Meanwhile soft handles let the surface carry the limb, so that it
neither tears off nor snaps back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.deform.handles import HARD

Array = NDArray[np.float64]

PATIENCE = 0.25  # [s] unseen before the handles soften: flicker changes nothing
LET_GO = 1.0  # [s] from firm to softest
TAKE_HOLD = 0.5  # [s] from softest to firm
LEVELS = 16  # of firmness; each change of level costs a factorization
FIRMEST, LOOSEST = 10.0, 1e-3  # weights of soft handles
LONGEST_STEP = 0.1  # [s] that a frame counts for at most


@dataclass(frozen=True, slots=True, eq=False)
class LimbReleaseState:
    """The state of a `LimbRelease` between two frames, for each of D limbs.

    Attributes:
        weights: (D,) of the handles.
        firmness: (D,) in [0, 1].
        unseen: (D,) [s] since each was last seen.
        is_firm: whether every limb is firm and seen.
        time: [s] of the last frame.
    """

    weights: Array
    firmness: Array
    unseen: Array
    is_firm: bool
    time: float


class LimbRelease:
    """The weights of the handles of D limbs over time.

    Args:
        count: D.

    Attributes:
        weights: (D,) of the handles of each limb: see `ArapSolver.hold`.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self.reset()

    def reset(self) -> None:
        """Make every limb firm, as at the beginning."""
        self.weights: Array = np.full(self._count, HARD)
        self._firmness = np.ones(self._count)
        self._unseen = np.zeros(self._count)
        self._is_firm = True  # whether every limb is firm and seen
        self._time = math.nan

    def snapshot(self) -> LimbReleaseState:
        """Return what is remembered between frames."""
        return LimbReleaseState(
            self.weights, self._firmness.copy(), self._unseen, self._is_firm, self._time
        )

    def restore(self, state: LimbReleaseState) -> None:
        """Go back to a snapshot of as many limbs."""
        self.weights, self._firmness = state.weights, state.firmness.copy()
        self._unseen, self._is_firm, self._time = state.unseen, state.is_firm, state.time

    def follow(self, time: float, seen: NDArray[np.bool_]) -> bool:
        """Take in which limbs are seen (D,) at `time` [s]; return whether a weight has changed."""
        passed = time - self._time
        self._time = time
        all_seen = bool(seen.all())
        if not passed > 0.0 or (all_seen and self._is_firm):
            return False
        passed = min(passed, LONGEST_STEP)
        self._unseen = np.where(seen, 0.0, self._unseen + passed)
        falling = np.where(self._unseen > PATIENCE, -passed / LET_GO, 0.0)
        self._firmness += np.where(seen, passed / TAKE_HOLD, falling)
        np.clip(self._firmness, 0.0, 1.0, out=self._firmness)
        weights = _weights(self._firmness)
        self._is_firm = all_seen and bool((self._firmness == 1.0).all())
        changed = not np.array_equal(weights, self.weights)
        self.weights = weights
        return changed


def _weights(firmness: Array) -> Array:
    level = np.floor(firmness * LEVELS) / LEVELS
    soft = LOOSEST * (FIRMEST / LOOSEST) ** level
    weights: Array = np.where(level >= 1.0, HARD, soft)
    return weights
