"""Faults of one body's frames: exchanged limbs are put right, what cannot be is not believed.

Both are judged by where the joints were and how they moved when they were last believed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.conditioning.body import Body
from solvers.continuity import LEAST_WRONG, exchanged, expected

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

FORGET = 0.5  # [s] after which nothing is expected of a joint any more
SHORTEST = 1e-3  # [s] between two frames, for velocities
VELOCITY_SECONDS = 0.02  # [s] shorter steps tell too little of a velocity to go by

INSIST_AT_LEAST, INSIST_AT_MOST = 0.5, 10.0  # [s] that a device must say otherwise to be believed

JUMP = 0.1  # [m] from where a joint is expected, at once
FASTEST = 6.0  # [m/s] further, for each second since it was believed
LONGEST_REACH = 0.1  # [s] for which that goes on
BELIEVED = 3  # frames after which a joint is known well enough to be doubted
CONFIRMED_SECONDS = 0.12  # [s] in one place after which a joint is believed there
CONFIRMED_CUT = 2  # frames after which a jump of the whole body is believed
CUT = 0.6  # of the joints seen that jump at once: that is no fault of a joint

STRETCHED = 0.47  # of the logarithm of a bone's length: by 1.6
STRETCHED_BY = 0.12  # [m] and so much at least
BONE_STEP = 0.02  # of its length that a bone's usual length gives way, each frame
BONES_MEASURED = 10  # frames


@dataclass(slots=True, eq=False)
class _Trust:
    """Of each joint: where and when it was last believed, its velocity, how often; since when and
    where it has been doubted; of each bone its usual length and how often it was measured."""

    place: Array
    velocity: Array
    at: Array
    times: NDArray[np.int64]
    doubted: Array
    doubted_at: Array
    doubts: NDArray[np.int64]
    lengths: Array
    measured: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """A frame's joints after its faults are mended.

    Attributes:
        positions: (J, 3) [m]; NaN where not seen or not believed.
        exchanged: (J,) bool, the joint's place was called its partner's.
        rejected: (J,) bool, the joint was seen but not believed.
    """

    positions: Array
    exchanged: Bools
    rejected: Bools


class Faults:
    """Mends the frames of one performer.

    Args:
        body: the skeleton's anatomy.
        joints: how many the skeleton has.
    """

    def __init__(self, body: Body, joints: int) -> None:
        self._body = body
        self._trust = _Trust(
            np.full((joints, 3), np.nan),
            np.zeros((joints, 3)),
            np.full(joints, -np.inf),
            np.zeros(joints, dtype=np.int64),
            np.full((joints, 3), np.nan),
            np.full(joints, np.nan),
            np.zeros(joints, dtype=np.int64),
            np.zeros(len(body.bones)),
            np.zeros(len(body.bones), dtype=np.int64),
        )
        groups = int(body.group.max(initial=-1)) + 1
        self._since = np.full(groups, np.nan)  # [s] when a group began to be exchanged
        self._straight = np.full(groups, np.nan)  # [s] when it began not to be
        self._nothing = np.zeros(joints, dtype=bool)

    def mend(self, positions: Array, time: float, *, swaps: bool, outliers: bool) -> Mended:
        """The frame with its faults mended.

        Args:
            positions: (J, 3) [m]; NaN where not seen.
            time: [s].
            swaps: put exchanged limbs right.
            outliers: reject what cannot be.
        """
        trust = self._trust
        gap = time - trust.at
        fresh = (gap < FORGET) & (gap > -FORGET)
        wanted = expected(trust.place, trust.velocity, np.where(fresh, gap, 0.0))
        wanted[~fresh] = np.nan
        swapped = rejected = self._nothing
        distance = _distance(positions, wanted)
        if swaps and len(self._since) and (distance > LEAST_WRONG).any():  # else nothing can be
            swapped = self._exchanged(positions, wanted, time)
            if swapped.any():
                positions = np.where(swapped[:, None], positions[self._body.partner], positions)
                distance = _distance(positions, wanted)
        elif swaps:
            self._since[:] = np.nan
            self._straight[np.isnan(self._straight)] = time
        seen = np.isfinite(positions[:, 0])
        if outliers:
            rejected = seen & self._doubtful(positions, distance, gap, seen, time)
            if rejected.any():
                positions = np.where(rejected[:, None], np.nan, positions)
                seen = seen & ~rejected
        self._believe(positions, seen, time)
        return Mended(positions, swapped & seen, rejected)

    def _exchanged(self, positions: Array, wanted: Array, time: float) -> Bools:
        """Which joints (J,) bear their partners' names.

        A device that goes on saying so for longer than it had said otherwise is believed.
        """
        groups = exchanged(positions, wanted, self._body.partner, self._body.group)
        self._since[~groups] = np.nan
        started = groups & np.isnan(self._since)
        self._since[started] = time
        self._straight[~groups & np.isnan(self._straight)] = time
        if not groups.any():
            return self._nothing
        before = np.nan_to_num(self._since - self._straight)
        patience = np.clip(before, INSIST_AT_LEAST, INSIST_AT_MOST)
        insists = groups & (time - self._since > patience)
        self._straight[insists] = time
        self._since[insists] = np.nan
        believed = groups & ~insists
        joints: Bools = np.append(believed, False)[self._body.group]
        if insists.any():  # nothing is known any more of these limbs
            self._trust.at[np.append(insists, False)[self._body.group]] = -np.inf
        return joints

    def _doubtful(
        self, positions: Array, distance: Array, gap: Array, seen: Bools, time: float
    ) -> Bools:
        trust = self._trust
        reach = JUMP + FASTEST * np.clip(gap, 0.0, LONGEST_REACH)
        far: Bools = distance > reach  # False where nothing is expected
        far &= trust.times >= BELIEVED
        stretched = self._stretched(positions, distance)
        if not far.any():
            trust.doubts[:] = 0
            return stretched
        cut = np.count_nonzero(far) >= CUT * np.count_nonzero(seen)
        return (far & ~self._confirmed(positions, far, time, bool(cut))) | stretched

    def _confirmed(self, positions: Array, doubtful: Bools, time: float, cut: bool) -> Bools:
        """Which doubtful joints have been so near one place for so long that they are there."""
        trust = self._trust
        step = positions - trust.doubted
        since = np.where(trust.doubts > 0, time - trust.doubted_at, 0.0)
        still = np.einsum("ij,ij->i", step, step) < (JUMP + 2.0 * np.maximum(since, 0.0)) ** 2
        trust.doubts = np.where(doubtful, np.where(still, trust.doubts, 0) + 1, 0)
        first = trust.doubts == 1
        trust.doubted_at[first] = time
        trust.doubted[doubtful] = positions[doubtful]
        confirmed: Bools = trust.doubts >= CONFIRMED_CUT
        if not cut:
            confirmed &= time - trust.doubted_at >= CONFIRMED_SECONDS
        return confirmed

    def _stretched(self, positions: Array, distance: Array) -> Bools:
        """The less expected ends of the long bones that have not their usual length.

        What hangs on them went along, unless the next bone too is stretched at this end. Nobody
        needs to confirm them: the usual length gives way with time.
        """
        body, trust = self._body, self._trust
        length = _distance(positions[body.bones], positions[body.near])
        known = np.isfinite(length) & (length > 0.0)
        length = np.where(known, length, 1.0)
        usual = np.where(trust.measured > 0, trust.lengths, length)
        off = np.abs(np.log(length / usual)) > STRETCHED
        off &= (np.abs(length - usual) > STRETCHED_BY) & known
        judged = off & (trust.measured >= BONES_MEASURED)
        share = np.maximum(BONE_STEP, 1.0 / (trust.measured + 1.0)) * usual
        step = np.clip(length - usual, -share, share)
        trust.lengths = np.where(known, usual + step, trust.lengths)
        trust.measured = trust.measured + known
        joints = np.zeros(len(positions), dtype=bool)
        if judged.any():
            worse = np.nan_to_num(distance[body.bones]) >= np.nan_to_num(distance[body.near])
            joints[body.near[judged & ~worse]] = True
            alone = joints[body.bones]
            joints[body.bones[judged & worse]] = True
            joints |= body.beyond[judged & worse & ~alone].any(axis=0)
        return joints

    def _believe(self, positions: Array, seen: Bools, time: float) -> None:
        trust = self._trust
        gap = time - trust.at
        again = seen & (gap < FORGET) & (gap > -FORGET)
        step = np.where(again, np.maximum(gap, VELOCITY_SECONDS), 1.0)[:, None]
        velocity = np.where(again[:, None], (positions - trust.place) / step, 0.0)
        trust.velocity = np.where(seen[:, None], velocity, trust.velocity)
        trust.place = np.where(seen[:, None], positions, trust.place)
        trust.times = np.where(seen, np.where(again, trust.times, 0) + 1, trust.times)
        trust.at = np.where(seen, time, trust.at)


def _distance(a: Array, b: Array) -> Array:
    """How far apart (n,) points are; NaN where one is unknown."""
    offset = a - b
    apart: Array = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    return apart
