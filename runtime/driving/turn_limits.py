"""How far a character's limbs may turn: those that would tear or crush its surface are held back.

A limb that has grown together with the body (an arm and its cape) would tear it when it turns as
far as the performer's; one that is shorter than it is wide would crush itself. Each turns by a
share of the performer's turns instead, the same for the whole show.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.driving.driver import MappedDriver
from runtime.driving.performer import Pose
from runtime.puppet.puppet import Motion, Puppet
from solvers.signal.histogram import Counts, count, percentile

Array = NDArray[np.float64]

MOST_STRETCH = 0.4  # of an edge
OF_ALL = 99.0  # percentile of all edges in all poses that may stretch no more
OF_LIMB = 95.0  # percentile of a limb's edges in any one pose that may stretch no more
EASY = 0.75  # of that: a pose that stretches less is not tried again
ROUNDS = 16  # at most
STEPS = (0.75, 0.9)  # least and greatest share by which a limb is held back in a round
HELPED = 0.98  # of the stretch that was: with more left, it is not this limb's doing

_BIN = 0.002  # of stretch: what a percentile is exact to
_BINS = 2001  # so stretches up to 4 are told apart; all above count as 4


def limit_turns(puppet: Puppet, driver: MappedDriver, poses: Sequence[Pose]) -> Array:
    """Try poses, and set the driver's gains so that the surface can follow all of them.

    Args:
        puppet: what is driven.
        driver: its driver, prepared.
        poses: T poses of the performer.

    Returns:
        (2, 3) [m] least and greatest corner of all that the puppet fills meanwhile, on the stage.
    """
    trial = _Trial(puppet, driver, poses)
    for _ in range(ROUNDS):
        if _tight(trial.all_edges.sum(axis=0), OF_ALL) <= MOST_STRETCH:
            break
        driver.gains *= _steps(_tightness(trial))
        trial.repeat(_tight(trial.all_edges, OF_ALL))
    for limb in range(len(driver.gains)):
        _spare(driver, trial, limb)
    puppet.forget()
    return corners_of(trial.boxes)


def box_of(motion: Motion) -> Array:
    """Return the least and greatest corner (2, 3) [m] of a character on the stage."""
    return np.array([motion.vertices.min(axis=0), motion.vertices.max(axis=0)])


def corners_of(boxes: Array) -> Array:
    """Return the least and greatest corner (2, 3) [m] of boxes (T, 2, 3) [m]."""
    return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


class _Trial:
    """T poses that a puppet of D limbs goes through.

    What a pose showed before a limb was held back stays as it was: smaller turns stretch no pose
    more, so it is a bound from above until the pose is tried again.

    Attributes:
        boxes: (T, 2, 3) [m] corners of what it fills in each.
        limb_edges: (T, D, B) how many of the edges that each limb pulls at stretch how much.
        all_edges: (T, B) how many of all edges do.
    """

    def __init__(self, puppet: Puppet, driver: MappedDriver, poses: Sequence[Pose]) -> None:
        self._puppet = puppet
        self._driver = driver
        self._poses = poses
        self._pulled = [np.flatnonzero(edges) for edges in driver.pulls().T]
        self._gains = np.empty((len(poses), len(self._pulled)))
        self.boxes = np.empty((len(poses), 2, 3))
        self.limb_edges = np.empty((len(poses), len(self._pulled), _BINS), dtype=np.int64)
        self.all_edges = np.empty((len(poses), _BINS), dtype=np.int64)
        for number in range(len(poses)):
            self.attempt(number)

    def repeat(self, tightness: Array) -> None:
        """Try again those that were not easy, (T,)."""
        for number in np.flatnonzero(tightness > EASY * MOST_STRETCH).tolist():
            self.attempt(number)

    def worst(self, limb: int) -> tuple[int, float]:
        """The pose that is worst for what a limb pulls at, and how tight that is there.

        Where it is not too tight anywhere, a pose and a bound for it.
        """
        while True:
            tight = _tight(self.limb_edges[:, limb], OF_LIMB)
            number = int(np.argmax(tight))
            is_bound = not np.array_equal(self._gains[number], self._driver.gains)
            if tight[number] <= MOST_STRETCH or not is_bound:
                return number, float(tight[number])
            self.attempt(number)

    def attempt(self, number: int) -> None:
        """Try one pose."""
        self._gains[number] = self._driver.gains
        self.boxes[number] = box_of(self._puppet.attempt(self._poses[number]))
        stretch = self._puppet.surface.stretch
        self.all_edges[number] = self.limb_edges[number] = 0
        count(stretch, _BIN, self.all_edges[number])
        for limb, edges in enumerate(self._pulled):
            count(stretch[edges], _BIN, self.limb_edges[number, limb])


def _tight(counts: Counts, percent: float) -> Array:
    """The stretch (...) that so many percent of the edges counted (..., B) do not pass."""
    return percentile(counts, _BIN, percent)


def _tightness(trial: _Trial) -> Array:
    """How tight (D,) what each limb pulls at is, over all poses."""
    tight = _tight(trial.limb_edges.sum(axis=0), OF_ALL)
    if tight.max(initial=0.0) <= MOST_STRETCH:  # the fault lies where no limb is: with all
        return np.full(len(tight), MOST_STRETCH / STEPS[1])
    return tight


def _steps(tight: Array | float) -> Array:
    """By what share limbs as tight as this are held back in a round; 1 for those that are not."""
    shares = np.clip(MOST_STRETCH / np.maximum(tight, MOST_STRETCH), STEPS[0], 1.0)
    return np.where(shares < 1.0, np.minimum(shares, STEPS[1]), 1.0)


def _spare(driver: MappedDriver, trial: _Trial, limb: int) -> None:
    """Hold one limb back until its edges are crushed in no pose, or that helps no more.

    The worst pose says how far, and whether it helps; others are tried again only where they may
    have become the worst.
    """
    for _ in range(ROUNDS):
        number, tight = trial.worst(limb)
        if tight <= MOST_STRETCH:
            return
        gain = driver.gains[limb]
        driver.gains[limb] *= _steps(tight)
        trial.attempt(number)
        if float(_tight(trial.limb_edges[number, limb], OF_LIMB)) > HELPED * tight:
            driver.gains[limb] = gain
            trial.attempt(number)
            return
