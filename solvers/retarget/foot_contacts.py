"""Which parts of a performer's feet stand on the floor, decided frame by frame.

A part (the ankle, which stands for the heel, or the toes) stands where it is low and slow. Both are
measured against the length of the legs. What counts as low is learned for each foot: a camera that
looks down sees one foot higher than the other, and recordings put the floor up to a hand's breadth
off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

# Lengths in leg lengths, speeds in leg lengths a second. Two numbers: to begin, and to end.
LOW = (0.06, 0.10)
SLOW = (0.25, 0.40)
NOISE = 1.5  # times the speed that noise alone would show is added to both
NOISIEST = 0.5  # the most that is added
QUIETER, NOISIER = 0.3, 4.0  # [s] in which the noise that is measured falls and rises
HOLD = (0.03, 0.03)  # [s] for how long a change must last
CERTAIN = 1.4  # times these numbers: a foot this high or fast has left the floor at once
SMOOTHING = 0.04  # [s] of the velocity
LONGEST = 0.25  # [s] between two frames: after a longer gap velocities start anew
FALLING, RISING = 0.15, 0.5  # [s] in which a foot's floor follows a lower foot, a higher slow one
STEP = 0.09  # a foot that is higher above its floor stands on something else, or not at all
UNEVEN = 0.15  # the most by which a foot's floor is above the lowest foot's
ALOFT, PATIENCE, DESCENT = 0.04, 0.8, 0.3  # see `_rise_under`; the last two [s]

# Of each part: where it was, its velocity as measured and smoothed, the noise [m] of its places,
# whether it stands, and since when it might no longer (or might begin to); NaN for not at all.
_PART = np.dtype(
    [
        ("place", np.float64, 3),
        ("measured", np.float64, 3),
        ("velocity", np.float64, 3),
        ("noise", np.float64),
        ("since", np.float64),
        ("stands", np.bool_),
    ],
    align=True,
)


@dataclass(frozen=True, slots=True, eq=False)
class FootContactsState:
    """The memory of a `FootContacts` at one moment.

    Attributes:
        parts: (F, 2) of `_PART`.
        floors: (F,) [m] the floor under each foot.
        aloft: [s] for how long no foot has been near its floor.
        time: [s] of the newest frame; NaN before the first.
    """

    parts: Records
    floors: Array
    aloft: float
    time: float


class FootContacts:
    """Tells ankles and toes that stand on the floor from those that do not.

    Args:
        rest: (F, 2) [m] height of ankle and toes of each foot in the skeleton's rest pose; only
            their difference counts. A foot without toes has its ankle twice.
        leg: [m] length of the performer's legs.

    Attributes:
        heights: (F, 2) [m] of ankles and toes above the height at which they stand; overwritten by
            the next frame.
        floors: (F,) [m] the height of each foot's lowest part when it stands; overwritten by the
            next frame.
    """

    def __init__(self, rest: Array, leg: float) -> None:
        self._standing = np.array(rest, dtype=np.float64)
        self._standing -= self._standing.min(axis=1, keepdims=True)
        self._leg = float(leg)
        self._parts = np.zeros(self._standing.shape, _PART)
        self.heights = np.zeros(self._standing.shape)
        self.floors = np.zeros(len(self._standing))
        self._aloft = 0.0
        self._time = math.nan

    @property
    def stands(self) -> Bools:
        """Whether ankles and toes (F, 2) stand; a view that the next frame overwrites."""
        return self._parts["stands"]

    def reset(self) -> None:
        """Forget all frames."""
        self._time = math.nan

    def snapshot(self) -> FootContactsState:
        """Return a copy of what the next frame depends on."""
        return FootContactsState(self._parts.copy(), self.floors.copy(), self._aloft, self._time)

    def restore(self, state: FootContactsState) -> None:
        """Go back to a snapshot of as many feet."""
        self._parts[:], self.floors[:] = state.parts, state.floors
        self._aloft, self._time = state.aloft, state.time

    def update(self, points: Array, time: float) -> Bools:
        """Take in a frame; return whether ankles and toes (F, 2) stand: `stands`.

        Args:
            points: (F, 2, 3) [m] ankles and toes. In the first frame the lowest foot is taken to
                stand.
            time: [s]; NaN for a frame on its own. If it steps back or leaps ahead, velocities start
                anew. Frames of the same time count as one.
        """
        dt = time - self._time
        if math.isnan(dt):
            self._aloft = 0.0
            _begin(self._parts, self.floors, points, self._standing, self._leg)
        elif dt != 0.0:
            _follow(self._parts, points, dt)
        if dt != 0.0:
            _settle_floors(self._parts, self.floors, points, self._standing, self._leg, dt)
            self._aloft = _rise_under(
                self.floors, points, self._standing, self._leg, self._aloft, dt
            )
            _decide(
                self._parts,
                self.floors,
                self.heights,
                points,
                self._standing,
                self._leg,
                dt,
                time,
            )
        self._time = time
        return self.stands


@kernel
def _lowest(points: Array, standing: Array, foot: int) -> float:
    """The floor that a foot would stand on if it stood."""
    ankle: float = points[foot, 0, 1] - standing[foot, 0]
    toes: float = points[foot, 1, 1] - standing[foot, 1]
    return min(ankle, toes)


@kernel
def _begin(parts: Records, floors: Array, points: Array, standing: Array, leg: float) -> None:
    """Take the lowest foot to stand."""
    floor = np.inf
    for foot in range(len(points)):
        floor = min(floor, _lowest(points, standing, foot))
    for foot in range(len(points)):
        floors[foot] = floor
        for part in range(2):
            own = parts[foot, part]
            for k in range(3):
                own.place[k] = points[foot, part, k]
                own.velocity[k], own.measured[k] = 0.0, np.nan
            own.since, own.noise = np.nan, np.nan
            own.stands = points[foot, part, 1] - standing[foot, part] - floor < LOW[0] * leg


@kernel
def _follow(parts: Records, points: Array, dt: float) -> None:
    known = 0.0 < dt <= LONGEST
    share = 1.0 - math.exp(-dt / SMOOTHING) if known else 0.0
    for foot in range(len(points)):
        for part in range(2):
            own = parts[foot, part]
            change = 0.0
            for k in range(3):
                if known:
                    speed = (points[foot, part, k] - own.place[k]) / dt
                    change += (speed - own.measured[k]) ** 2
                    own.measured[k] = speed
                    own.velocity[k] += share * (speed - own.velocity[k])
                else:
                    own.measured[k], own.velocity[k] = np.nan, 0.0
                own.place[k] = points[foot, part, k]
            if not known:
                own.since = np.nan
            elif not math.isnan(change):
                _learn_noise(own, dt * math.sqrt(change), dt)


@kernel
def _learn_noise(part: Any, change: float, dt: float) -> None:
    """Keep the least change of step [m], frame by frame, that has been usual lately.

    A foot that steps changes its steps as well, but stands in between; noise never rests.
    """
    if math.isnan(part.noise):
        part.noise = change
    else:
        seconds = QUIETER if change < part.noise else NOISIER
        part.noise += (1.0 - math.exp(-dt / seconds)) * (change - part.noise)


@kernel
def _speed(part: Any) -> float:
    x, y, z = part.velocity[0], part.velocity[1], part.velocity[2]
    return math.sqrt(x * x + y * y + z * z)


@kernel
def _settle_floors(
    parts: Records, floors: Array, points: Array, standing: Array, leg: float, dt: float
) -> None:
    """Let each foot's floor sink under a lower foot, and rise under one that rests on it."""
    if not 0.0 < dt <= LONGEST:
        return
    fall, rise = 1.0 - math.exp(-dt / FALLING), 1.0 - math.exp(-dt / RISING)
    lowest = np.inf
    for foot in range(len(points)):
        above = _lowest(points, standing, foot) - floors[foot]
        speed = min(_speed(parts[foot, 0]), _speed(parts[foot, 1]))
        if above < 0.0:
            floors[foot] += fall * above
        elif above < STEP * leg and speed < SLOW[0] * leg:
            floors[foot] += rise * above
        lowest = min(lowest, floors[foot])
    for foot in range(len(points)):
        floors[foot] = min(floors[foot], lowest + UNEVEN * leg)


@kernel
def _rise_under(
    floors: Array, points: Array, standing: Array, leg: float, aloft: float, dt: float
) -> float:
    """Let the floor rise under feet that have been off it for longer than a jump lasts.

    Returns:
        [s] for how long no foot has been near its floor.
    """
    above = np.inf
    for foot in range(len(points)):
        above = min(above, _lowest(points, standing, foot) - floors[foot])
    if above < ALOFT * leg or not 0.0 < dt <= LONGEST:
        return 0.0
    if aloft > PATIENCE:
        for foot in range(len(points)):
            floors[foot] += (1.0 - math.exp(-dt / DESCENT)) * above
    return aloft + dt


@kernel
def _decide(
    parts: Records,
    floors: Array,
    heights: Array,
    points: Array,
    standing: Array,
    leg: float,
    dt: float,
    time: float,
) -> None:
    """Let parts begin or cease to stand once they have been low and slow, or not, for a while."""
    # The smoothed velocity of a resting point whose places have noise of such a size.
    shown = NOISE * 0.75 * (1.0 - math.exp(-dt / SMOOTHING)) / (dt * leg) if dt > 0.0 else 0.0
    for foot in range(len(points)):
        for part in range(2):
            own = parts[foot, part]
            speed = _speed(own) / leg
            height = points[foot, part, 1] - standing[foot, part] - floors[foot]
            heights[foot, part] = height
            height /= leg
            end = 1 if own.stands else 0
            if own.noise > 0.0:  # not NaN
                speed -= min(shown * own.noise, NOISIEST)
            low_and_slow = height < LOW[end] and speed < SLOW[end]
            if low_and_slow == own.stands:
                own.since = np.nan
                continue
            if math.isnan(own.since):
                own.since = time
            gone = height > CERTAIN * LOW[1] or speed > CERTAIN * SLOW[1]
            if time - own.since >= HOLD[end] or (own.stands and gone):
                own.stands, own.since = not own.stands, np.nan
