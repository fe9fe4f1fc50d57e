"""Turns the feet of a character: flat while the performer's are flat, tilted as theirs tilt.

A performer's foot points from the ankle down to the toes, by an angle that is their skeleton's and
not the character's. So the tilt is measured from the angle at which the foot stands, which is
learned while it does. The direction over the ground (toes out, toes in) is the performer's own.

A character's foot may be longer than the performer's. It tilts no further than it has room above
the floor, or toes that point down would lift the whole body.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import multiply

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

LEARNING = 0.5  # [s] in which the angle of a standing foot is learned
EASING = 0.06  # [s] in which a foot gets level after it has come down
ANGLES = np.radians(np.arange(-90.0, 91.0, 5.0))
"""The pitches [rad] at which the depth of a sole is known; toes up is positive."""
STEEP = 0.7  # level share of a foot's direction below which the body's own left counts too

# Of each foot: its elevation [rad] while it stands, and how level it is kept (0 to 1).
_FOOT = np.dtype([("planted", np.float64), ("level", np.float64)], align=True)


@dataclass(frozen=True, slots=True, eq=False)
class SolePitchState:
    """The memory of a `SolePitch`: (F,) of `_FOOT`, and the newest time [s], NaN before any."""

    feet: Records
    time: float


class SolePitch:
    """The rotations of a character's feet.

    Args:
        rest: (F, 3) direction of each foot of the character at rest, from ankle to toes; any
            length.
        standing: (F, 3) the same of the performer, as the skeleton's rest pose has it. For a
            performer without toes: the character's `rest`.
        toes: (F,) whether the performer's foot has toes. Without them it is level while it stands.
        depths: (F, A) [m] how far each foot of the character reaches below its ankle: see
            `sole_depths`.

    Attributes:
        above: (F,) [m] how high each sole is where its ankle is as high as given; overwritten by
            the next frame.
    """

    def __init__(self, rest: Array, standing: Array, toes: Bools, depths: Array) -> None:
        self._rest = np.array(rest, dtype=np.float64)
        self._toes = np.array(toes, dtype=np.bool_)
        self._depths = np.array(depths, dtype=np.float64)
        self._elevations = np.arctan2(standing[:, 1], np.hypot(standing[:, 0], standing[:, 2]))
        self._feet = np.zeros(len(self._rest), _FOOT)
        self.above = np.zeros(len(self._rest))
        self._time = math.nan

    def reset(self) -> None:
        """Forget all frames."""
        self._time = math.nan

    def snapshot(self) -> SolePitchState:
        """Return a copy of what the next frame depends on."""
        return SolePitchState(self._feet.copy(), self._time)

    def restore(self, state: SolePitchState) -> None:
        """Go back to a snapshot of as many feet."""
        self._feet[:], self._time = state.feet, state.time

    def turns(self, feet: Array, left: Array, heights: Array, stands: Bools, time: float) -> Array:
        """Return the rotations (F, 4) of the character's feet, world, from rest.

        Args:
            feet: (F, 3) [m] from the performer's ankle to the toes; without toes, where the
                character's foot points when it turns with the shin.
            left: (3,) the direction to the body's left.
            heights: (F,) [m] of the ankles above the height at which they stand, in the size of the
                character.
            stands: (F,) whether the ankles stand.
            time: [s]; NaN for a frame on its own.
        """
        dt = time - self._time
        if math.isnan(dt):
            self._feet["planted"], self._feet["level"] = self._elevations, stands
        dt = dt if dt > 0.0 else 0.0
        self._time = time
        out = np.empty((len(feet), 4))
        known = self._rest, self._depths, self._toes
        _tilt(self._feet, known, feet, left, heights, stands, dt, out, self.above)
        return out


@kernel
def _tilt(
    memory: Records,
    known: tuple[Array, Array, Bools],
    feet: Array,
    left: Array,
    heights: Array,
    stands: Bools,
    dt: float,
    out: Array,
    above: Array,
) -> None:
    rest, depths, toes = known
    learn, ease = 1.0 - math.exp(-dt / LEARNING), 1.0 - math.exp(-dt / EASING)
    for i in range(len(feet)):
        foot = memory[i]
        x, y, z = feet[i, 0], feet[i, 1], feet[i, 2]
        aside_x, aside_z = _left_of(x, y, z, left[0], left[2])
        elevation = math.atan2(y, z * aside_x - x * aside_z)
        foot.level += ease * ((1.0 if stands[i] else 0.0) - foot.level)
        if stands[i] and toes[i]:
            foot.planted += learn * (elevation - foot.planted)
        pitch = elevation - foot.planted
        if not toes[i]:
            pitch *= 1.0 - foot.level
        pitch = _above_floor(depths[i], pitch, max(heights[i], 0.0))
        above[i] = heights[i] + _depth(depths[i], 0.0) - _depth(depths[i], pitch)
        yaw = math.atan2(-aside_z, aside_x) - math.atan2(rest[i, 0], rest[i, 2])
        level = (0.0, math.sin(0.5 * yaw), 0.0, math.cos(0.5 * yaw))
        sine = math.sin(-0.5 * pitch)
        tilt = (sine * aside_x, 0.0, sine * aside_z, math.cos(0.5 * pitch))
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = multiply(tilt, level)


@kernel
def _above_floor(depths: Array, pitch: float, room: float) -> float:
    """The pitch, or the nearest to it on the way to level with which the sole has room enough."""
    most = _depth(depths, 0.0) + room
    if _depth(depths, pitch) <= most:
        return pitch
    low, high = 0.0, pitch
    for _ in range(20):
        middle = 0.5 * (low + high)
        if _depth(depths, middle) <= most:
            low = middle
        else:
            high = middle
    return low


@kernel
def _depth(depths: Array, pitch: float) -> float:
    last = len(ANGLES) - 1
    at = (pitch - ANGLES[0]) / (ANGLES[last] - ANGLES[0]) * last
    at = min(max(at, 0.0), float(last))
    before = min(int(at), last - 1)
    share = at - before
    depth: float = (1.0 - share) * depths[before] + share * depths[before + 1]
    return depth


def sole_depths(points: Array, forward: Array) -> Array:
    """Return how far (A,) [m] a foot reaches below its ankle at the pitches `ANGLES`.

    Args:
        points: (n, 3) [m] of its surface at rest, from the ankle; n > 0.
        forward: (3,) where it points at rest; only along the floor.
    """
    level = np.array([forward[0], forward[2]])
    level = level / max(float(np.linalg.norm(level)), 1e-12)
    ahead = points[:, [0, 2]] @ level
    heights = np.outer(np.cos(ANGLES), points[:, 1]) + np.outer(np.sin(ANGLES), ahead)
    depths: Array = -heights.min(axis=1)
    return depths


@kernel
def _left_of(x: float, y: float, z: float, left_x: float, left_z: float) -> tuple[float, float]:
    """The level direction (x, z) to the left of a foot; of the body, for a foot that is upright."""
    size = math.sqrt(x * x + y * y + z * z)
    far = math.hypot(left_x, left_z)
    if size > 1e-12:
        x, z = x / size, z / size
    weight = max(1.0 - math.hypot(x, z) / STEEP, 0.0) ** 2
    if far > 1e-12:
        weight /= far
    aside_x, aside_z = z + weight * left_x, weight * left_z - x
    size = math.hypot(aside_x, aside_z)
    if size > 1e-9:
        return aside_x / size, aside_z / size
    return 1.0, 0.0
