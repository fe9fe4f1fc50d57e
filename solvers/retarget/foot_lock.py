"""Keeps the feet of a character where they were planted.

A character's legs are longer or shorter than the performer's, its hips wider or narrower. So feet
that point where the performer's point slide on the floor. While a part of a foot stands (ankle or
toes), it is kept at its place on the floor, and its height is left alone: to make the feet equally
high as well would bend the legs by many degrees where a sensor sees one foot higher.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.retarget.two_bone_ik import within_reach

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

# Lengths in leg lengths of the character.
PLAY = 0.03  # how far a standing foot of the performer drifts before the planted one goes along
CREEP = 0.012  # [1/s] how fast a planted foot may move to where the leg alone would put it
NEAR, PULL = 0.08, 4.0  # a foot farther from where the leg would put it goes there, at [1/s]
FARTHEST = 0.25  # from its place before locking: a foot that is farther off lets go
HOME = 0.02  # a foot that has let go is planted again when it is this near
RETURN = 35.0  # [1/s] of the way back: a tenth of it is left after 0.11 s
FASTEST = 3.0  # [leg lengths/s] at which a foot starts on its way back
LONGEST = 0.25  # [s] between two frames: after a longer gap feet start anew

# The toes come last and leave last: where both stand, the foot turns about them.
NONE, ANKLE, TOES = -1, 0, 1

# Of each foot: the part that is planted, where it is planted and where the performer's
# is (x and z), the offset from the unlocked foot and its velocity, and whether the foot has let go.
_FOOT = np.dtype(
    [
        ("part", np.int64),
        ("plant", np.float64, 2),
        ("performer", np.float64, 2),
        ("offset", np.float64, 2),
        ("velocity", np.float64, 2),
        ("let_go", np.bool_),
    ],
    align=True,
)


@dataclass(frozen=True, slots=True, eq=False)
class FootLockState:
    """The memory of a `FootLock` at one moment: (F,) of `_FOOT`, and the newest time [s] or NaN."""

    feet: Records
    time: float


class FootLock:
    """Plants feet, and lets them go.

    A planted foot may move as far as the performer's does once that has drifted by `PLAY`, and by
    `CREEP`, and farther than `NEAR` from where the legs alone would put it with `PULL`, never more.
    What it may move brings it there. It lets go when it is too far from there. From then on it goes
    back smoothly, also in velocity.

    Args:
        legs: (F,) [m] length of the character's legs from hip to ankle.
    """

    def __init__(self, legs: Array) -> None:
        self._legs = np.array(legs, dtype=np.float64)
        self._feet = np.zeros(len(self._legs), _FOOT)
        self._time = math.nan

    @property
    def offsets(self) -> Array:
        """The offsets (F, 2) [m] along x and z of the newest goals from the unlocked ankles."""
        return self._feet["offset"]

    def reset(self) -> None:
        """Forget where feet are planted."""
        self._time = math.nan

    def snapshot(self) -> FootLockState:
        """Return a copy of what the next frame depends on."""
        return FootLockState(self._feet.copy(), self._time)

    def restore(self, state: FootLockState) -> None:
        """Go back to a snapshot of as many feet."""
        self._feet[:], self._time = state.feet, state.time

    def goals(
        self, hips: Array, points: Array, performer: Array, stands: Bools, time: float
    ) -> Array:
        """Return the goals (F, 3) [m] of the character's ankles.

        Args:
            hips: (F, 3) [m] hip joints of the character on the stage.
            points: (F, 2, 3) [m] its ankles and toes on the stage, unlocked.
            performer: (F, 2, 3) [m] the performer's ankles and toes, brought to the stage as the
                travel of the hips is: turned and scaled.
            stands: (F, 2) whether the performer's ankles and toes stand; see `FootContacts`.
            time: [s]. If it steps back or leaps ahead, or is NaN, all feet start anew.
        """
        dt = time - self._time
        if not 0.0 <= dt <= LONGEST:  # also before the first frame
            self._feet[:] = np.zeros((), _FOOT)
            self._feet["part"] = NONE
            dt = 0.0
        self._time = time
        out = np.empty((len(points), 3))
        _lock(self._feet, self._legs, hips, points, performer, stands, dt, out)
        return out


@kernel
def _lock(
    feet: Records,
    legs: Array,
    hips: Array,
    points: Array,
    performer: Array,
    stands: Bools,
    dt: float,
    out: Array,
) -> None:
    for i in range(len(points)):
        foot, leg = feet[i], legs[i]
        best = TOES if stands[i, TOES] else ANKLE if stands[i, ANKLE] else NONE
        if foot.part not in (NONE, best):
            _plant(foot, best, points[i], performer[i])
        if foot.part != NONE:
            _stay(foot, points[i, foot.part], performer[i, foot.part], leg, dt)
        else:
            _return(foot, dt)
            _land(foot, best, points[i], performer[i], HOME * leg)
        hip = (hips[i, 0], hips[i, 1], hips[i, 2])
        ankle = (points[i, 0, 0], points[i, 0, 1], points[i, 0, 2])
        goal = (ankle[0] + foot.offset[0], ankle[1], ankle[2] + foot.offset[1])
        out[i, 0], out[i, 1], out[i, 2] = within_reach(hip, ankle, goal, leg)


@kernel
def _land(foot: Any, part: int, points: Array, performer: Array, home: float) -> None:
    """Plant the part of a foot that stands; a foot that has let go must first be back."""
    if part == NONE:
        foot.let_go = False
    elif not foot.let_go or math.hypot(foot.offset[0], foot.offset[1]) < home:
        foot.let_go = False
        _plant(foot, part, points, performer)


@kernel
def _plant(foot: Any, part: int, points: Array, performer: Array) -> None:
    """Keep a part of the foot where it is now; or none."""
    foot.part = part
    if part == NONE:
        return
    for k in range(2):
        foot.plant[k] = points[part, 2 * k] + foot.offset[k]
        foot.performer[k] = performer[part, 2 * k]


@kernel
def _stay(foot: Any, point: Array, performer: Array, leg: float, dt: float) -> None:
    """Keep the planted part in its place, but for what it may move."""
    x, z = foot.plant[0] - point[0], foot.plant[1] - point[2]
    far = max(math.hypot(x, z) - NEAR * leg, 0.0)
    budget = CREEP * leg * dt + far * (1.0 - math.exp(-PULL * dt))
    x, z = performer[0] - foot.performer[0], performer[2] - foot.performer[1]
    drift = math.hypot(x, z)
    if drift > PLAY * leg:
        share = 1.0 - PLAY * leg / drift
        budget += share * drift
        foot.performer[0] += share * x
        foot.performer[1] += share * z
    x, z = foot.plant[0] - point[0], foot.plant[1] - point[2]
    share = min(budget / max(math.hypot(x, z), 1e-12), 1.0)
    foot.plant[0] -= share * x
    foot.plant[1] -= share * z
    x, z = foot.plant[0] - point[0], foot.plant[1] - point[2]
    if math.hypot(x, z) > FARTHEST * leg:
        foot.part, foot.let_go = NONE, True
        _return(foot, dt)
        return
    if dt > 0.0:
        foot.velocity[0], foot.velocity[1] = (x - foot.offset[0]) / dt, (z - foot.offset[1]) / dt
        fast = math.hypot(foot.velocity[0], foot.velocity[1])
        if fast > FASTEST * leg:
            foot.velocity[0] *= FASTEST * leg / fast
            foot.velocity[1] *= FASTEST * leg / fast
    foot.offset[0], foot.offset[1] = x, z


@kernel
def _return(foot: Any, dt: float) -> None:
    """Bring the offset to zero as a critically damped spring does, by its exact solution."""
    fade = math.exp(-RETURN * dt)
    for k in range(2):
        at, speed = foot.offset[k], foot.velocity[k]
        pull = speed + RETURN * at
        foot.offset[k] = (at + pull * dt) * fade
        foot.velocity[k] = (speed - RETURN * pull * dt) * fade
