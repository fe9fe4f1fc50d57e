"""How far a character's limbs may turn: those that would tear or crush its surface are held back.

A limb that has grown together with the body (an arm and its cape) would tear it when it turns as
far as the performer's; one that is shorter than it is wide would crush itself. Each turns by a
share of the performer's turns instead, the same for the whole show.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.performer import Pose
from runtime.puppet import Puppet

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MOST_STRETCH = 0.4  # of an edge
OF_ALL = 99.0  # percentile of all edges in all poses that may stretch no more
OF_LIMB = 95.0  # percentile of a limb's edges in any one pose that may stretch no more
EASY = 0.75  # of that: a pose that stretches less is not tried again
ROUNDS = 16  # at most
STEPS = (0.75, 0.9)  # least and greatest share by which a limb is held back in a round
HELPED = 0.98  # of the stretch that was: with more left, it is not this limb's doing


def restrain(puppet: Puppet, poses: Sequence[Pose]) -> Array:
    """Go through poses and set the puppet's gains so that its surface can follow them all.

    Returns:
        (2, 3) [m] least and greatest corner of all that it fills meanwhile, on the stage.
    """
    trial = _Trial(puppet, poses)
    pulls = puppet.pulls()
    for _ in range(ROUNDS):
        if np.percentile(trial.stretch, OF_ALL) <= MOST_STRETCH:
            break
        puppet.gains *= _steps(_tightness(trial.stretch, pulls))
        trial.repeat(np.percentile(trial.stretch, OF_ALL, axis=1))
    for limb, edges in enumerate(pulls.T):
        if edges.any():
            _spare(puppet, trial, limb, edges)
    puppet.forget()
    return np.array([trial.boxes[:, 0].min(axis=0), trial.boxes[:, 1].max(axis=0)])


class _Trial:
    """Poses that a puppet goes through.

    Attributes:
        boxes: (T, 2, 3) [m] corners of what it fills in each.
        stretch: (T, E) relative change of the length of its edges.
    """

    def __init__(self, puppet: Puppet, poses: Sequence[Pose]) -> None:
        self._puppet = puppet
        self._poses = poses
        boxes, stretches = zip(*map(puppet.attempt, poses), strict=True)
        self.boxes, self.stretch = np.array(boxes), np.array(stretches)

    def repeat(self, tightness: Array) -> None:
        """Try again those that were not easy, (T,): smaller turns stretch no pose more."""
        for number in np.flatnonzero(tightness > EASY * MOST_STRETCH).tolist():
            self.boxes[number], self.stretch[number] = self._puppet.attempt(self._poses[number])


def _tightness(stretch: Array, pulls: Bools) -> Array:
    """How tight (D,) what each drive pulls at is, of all E edges in T poses."""
    tight = [np.percentile(stretch[:, edges], OF_ALL) if edges.any() else 0.0 for edges in pulls.T]
    if max(tight, default=0.0) <= MOST_STRETCH:  # the fault lies where no limb is: with all
        return np.full(len(tight), MOST_STRETCH / STEPS[1])
    return np.array(tight)


def _steps(tight: Array) -> Array:
    """By what share drives as tight as this are held back in a round; 1 for those that are not."""
    shares = np.clip(MOST_STRETCH / np.maximum(tight, MOST_STRETCH), STEPS[0], 1.0)
    return np.where(shares < 1.0, np.minimum(shares, STEPS[1]), 1.0)


def _spare(puppet: Puppet, trial: _Trial, limb: int, edges: Bools) -> None:
    """Hold one limb back until its edges (E,) are crushed in no pose, or that helps no more."""
    tight = np.percentile(trial.stretch[:, edges], OF_LIMB, axis=1)
    for _ in range(ROUNDS):
        worst, gain = tight.max(), puppet.gains[limb]
        if worst <= MOST_STRETCH:
            return
        puppet.gains[limb] *= _steps(worst)
        trial.repeat(tight)
        tight, before = np.percentile(trial.stretch[:, edges], OF_LIMB, axis=1), tight
        if tight.max() > HELPED * worst:
            puppet.gains[limb] = gain
            trial.repeat(before)
            return
