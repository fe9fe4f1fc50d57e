"""Limits the turns of a character's limbs so that they neither tear nor crush its surface.

An arm that has grown together with a cape would tear it if it turned as far as the performer's. A
limb that is shorter than it is wide would crush itself. Such a limb turns by a share of the
performer's turns, its gain, which is the same for the whole show.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.driving.driver import Driver, MappedDriver
from runtime.driving.performer import Pose
from runtime.puppet.puppet import Puppet
from solvers.signal.histogram import Counts, count, percentile

Array = NDArray[np.float64]

OF_ALL = 99.0  # percentile of all edges in all poses that is bounded
OF_LIMB = 95.0  # percentile of a limb's edges in any one pose that is bounded
EASY = 0.75  # share of a bound: a pose that stretches less is not tried again
ROUNDS = 16  # at most
STEPS = (0.75, 0.9)  # least and greatest factor of a limb's gain in a round
HELPED = 0.98  # of the stretch before: if more is left, the limb is not the cause

_BIN = 0.002  # of stretch: the precision of a percentile
_BINS = 2001  # for stretches up to 4; all above count as 4


def limit_turns(puppet: Puppet, driver: MappedDriver, poses: Sequence[Pose]) -> Array:
    """Try poses, and set the driver's gains so that the surface can follow all of them.

    Args:
        puppet: what is driven.
        driver: its driver, prepared.
        poses: T poses of the performer.

    Returns:
        (2, 3) [m] least and greatest corner of all that the puppet fills meanwhile, in place.
    """
    trial = _Trial(puppet, driver, poses)
    for _ in range(ROUNDS):
        most = driver.limits.of_all
        if _tight(trial.all_edges.sum(axis=0), OF_ALL) <= most:
            break
        driver.gains *= _steps(_tightness(trial, most), most)
        trial.repeat(_tight(trial.all_edges, OF_ALL))
    for limb in range(len(driver.gains)):
        _spare(driver, trial, limb)
    puppet.forget()
    return _corners_of(trial.boxes)


def _box_of(puppet: Puppet, pose: Pose) -> Array:
    """Try a pose, and return the least and greatest corner (2, 3) [m] of the puppet in place."""
    vertices = puppet.attempt(pose).vertices
    box = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    box[:, ::2] -= puppet.travelled
    return box


def _corners_of(boxes: Array) -> Array:
    """Return the least and greatest corner (2, 3) [m] of boxes (T, 2, 3) [m]."""
    return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def tried_out(puppet: Puppet, driver: Driver, poses: Sequence[Pose]) -> Array:
    """Try poses, and limit the turns where chains are driven; return what the puppet fills (2, 3).

    Args:
        puppet: what is driven.
        driver: its driver, prepared.
        poses: at least one.
    """
    if isinstance(driver, MappedDriver):
        return limit_turns(puppet, driver, poses)
    filled = _corners_of(np.array([_box_of(puppet, pose) for pose in poses]))
    puppet.forget()
    return filled


class _Trial:
    """T poses that a puppet of D limbs tries.

    The stretch of a pose is not measured again for every gain: smaller turns stretch no pose more,
    so the old measurement is an upper bound until the pose is tried again.

    Attributes:
        boxes: (T, 2, 3) [m] corners of the puppet in each pose.
        limb_edges: (T, D, B) histogram of the stretch of the edges that each limb pulls at.
        all_edges: (T, B) histogram of the stretch of all edges.
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
        """Try those poses again that were not easy by their tightness (T,)."""
        for number in np.flatnonzero(tightness > EASY * self._driver.limits.of_all).tolist():
            self.attempt(number)

    def worst(self, limb: int) -> tuple[int, float]:
        """Return the pose that stretches a limb's edges most, and their stretch in it.

        If no pose stretches them too far, return some pose and an upper bound.
        """
        while True:
            tight = _tight(self.limb_edges[:, limb], OF_LIMB)
            number = int(np.argmax(tight))
            is_bound = not np.array_equal(self._gains[number], self._driver.gains)
            if tight[number] <= self._driver.limits.of_limb or not is_bound:
                return number, float(tight[number])
            self.attempt(number)

    def attempt(self, number: int) -> None:
        """Try one pose."""
        self._gains[number] = self._driver.gains
        self.boxes[number] = _box_of(self._puppet, self._poses[number])
        stretch = self._puppet.surface.stretch
        self.all_edges[number] = self.limb_edges[number] = 0
        count(stretch, _BIN, self.all_edges[number])
        for limb, edges in enumerate(self._pulled):
            count(stretch[edges], _BIN, self.limb_edges[number, limb])


def _tight(counts: Counts, percent: float) -> Array:
    """Return the percentile (...) of stretch of histograms (..., B)."""
    return percentile(counts, _BIN, percent)


def _tightness(trial: _Trial, most: float) -> Array:
    """Return the stretch (D,) of the edges that each limb pulls at, over all poses."""
    tight = _tight(trial.limb_edges.sum(axis=0), OF_ALL)
    if tight.max(initial=0.0) <= most:  # no limb alone is the cause: all are
        return np.full(len(tight), most / STEPS[1])
    return tight


def _steps(tight: Array | float, most: float) -> Array:
    """Return the factor of the gains of limbs with this stretch; 1 where it is at most `most`."""
    shares = np.clip(most / np.maximum(tight, most), STEPS[0], 1.0)
    return np.where(shares < 1.0, np.minimum(shares, STEPS[1]), 1.0)


def _spare(driver: MappedDriver, trial: _Trial, limb: int) -> None:
    """Reduce one limb's gain until no pose crushes its edges, or a smaller gain does not help.

    The worst pose decides how far, and whether it helps. Others are tried again only where they may
    have become the worst.
    """
    for _ in range(ROUNDS):
        number, tight = trial.worst(limb)
        if tight <= driver.limits.of_limb:
            return
        gain = driver.gains[limb]
        driver.gains[limb] *= _steps(tight, driver.limits.of_limb)
        trial.attempt(number)
        if float(_tight(trial.limb_edges[number, limb], OF_LIMB)) > HELPED * tight:
            driver.gains[limb] = gain
            trial.attempt(number)
            return
