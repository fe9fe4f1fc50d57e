"""Turns the feet of a character: flat while the performer's are flat, tilted as theirs tilt.

A performer's foot points from the ankle down to the toes, by an angle that is their skeleton's and
not the character's. So the tilt is measured from the angle at which the foot stands, which is
learned while it does. The direction over the ground (toes out, toes in) is the performer's own.
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
        standing: (F, 3) [m] the same of the performer, as the skeleton's rest pose has it. Its
            length is the foot's. For a performer without toes: the character's `rest`, scaled to
            the performer.
        toes: (F,) whether the performer's foot has toes. Without them it is level while it stands.
    """

    def __init__(self, rest: Array, standing: Array, toes: Bools) -> None:
        self._rest = np.array(rest, dtype=np.float64)
        self._toes = np.array(toes, dtype=np.bool_)
        self._lengths = np.linalg.norm(standing, axis=1)
        self._elevations = np.arctan2(standing[:, 1], np.hypot(standing[:, 0], standing[:, 2]))
        self._feet = np.zeros(len(self._rest), _FOOT)
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
            heights: (F,) [m] of the performer's ankles above the height at which they stand.
            stands: (F,) whether the ankles stand.
            time: [s]; NaN for a frame on its own.
        """
        dt = time - self._time
        if math.isnan(dt):
            self._feet["planted"], self._feet["level"] = self._elevations, stands
        dt = dt if dt > 0.0 else 0.0
        self._time = time
        out = np.empty((len(feet), 4))
        known = self._rest, self._lengths, self._toes
        _tilt(self._feet, known, feet, left, heights, stands, dt, out)
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
) -> None:
    rest, lengths, toes = known
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
        # The toes do not reach below the floor: an ankle that is low has no room under it.
        room = max(heights[i], 0.0) / max(lengths[i], 1e-9)
        pitch = max(pitch, math.asin(max(math.sin(foot.planted) - room, -1.0)) - foot.planted)
        yaw = math.atan2(-aside_z, aside_x) - math.atan2(rest[i, 0], rest[i, 2])
        level = (0.0, math.sin(0.5 * yaw), 0.0, math.cos(0.5 * yaw))
        sine = math.sin(-0.5 * pitch)
        tilt = (sine * aside_x, 0.0, sine * aside_z, math.cos(0.5 * pitch))
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = multiply(tilt, level)


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
