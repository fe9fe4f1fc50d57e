"""How camera and spot lights glide after characters that travel over the stage.

Each is a critically damped spring after the way of its character, by the show's time and not by a
clock, so that a recording gives the same pictures each time. Small steps move nothing. The further
behind it is, the stiffer the spring, so that nobody runs out of the picture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLACK = 0.1  # [m] that a character may go to and fro without being followed
BRISK = 4.0  # [1/s] of the spring while it is hardly behind
STIFFER = 0.05  # [m] behind at which it is twice as stiff
FASTEST = 5.0  # [m/s]
JUMP = 1.5  # [m] in one frame: a character that was put elsewhere, as at the end of a loop
LONGEST_STEP = 0.1  # [s] that a frame counts for at most
STILL = 0.01  # [m/s] below which what has arrived stands still


@dataclass(frozen=True, slots=True, eq=False)
class GlideState:
    """The state of a `Glide` between two frames.

    Attributes:
        places, speeds: (A, 2) [m] and [m/s] along x and z.
        ways: (A, 2) [m] of the last frame.
        at: [s] of the last frame; NaN before the first one.
    """

    places: Array
    speeds: Array
    ways: Array
    at: float


class Glide:
    """Glides after A characters.

    Args:
        count: A.

    Attributes:
        places: (A, 2) [m] along x and z, how far it has come after each character from home.
    """

    def __init__(self, count: int) -> None:
        self.places = np.zeros((count, 2))
        self._speeds = np.zeros((count, 2))
        self._ways = np.zeros((count, 2))
        self._at = math.nan

    def follow(self, ways: Array, time: float) -> None:
        """Go on to a frame.

        Args:
            ways: (A, 2) [m] along x and z, how far each character has travelled from home.
            time: [s] of the frame. In the first one it is with the characters at once.
        """
        passed = min(max(time - self._at, 0.0), LONGEST_STEP)
        jumped = np.linalg.norm(ways - self._ways, axis=1) > JUMP
        if math.isnan(self._at):
            jumped[:] = True
        self.places, self._speeds = _sprung(self.places, self._speeds, ways, passed)
        self.places[jumped], self._speeds[jumped] = ways[jumped], 0.0
        self._ways, self._at = ways.copy(), time

    def snapshot(self) -> GlideState:
        """Return what is remembered between frames."""
        return GlideState(self.places.copy(), self._speeds.copy(), self._ways.copy(), self._at)

    def restore(self, state: GlideState) -> None:
        """Go back to a snapshot."""
        self.places, self._speeds = state.places.copy(), state.speeds.copy()
        self._ways, self._at = state.ways.copy(), state.at


def _sprung(places: Array, speeds: Array, ways: Array, passed: float) -> tuple[Array, Array]:
    """Return places and speeds (A, 2) after `passed` [s], for springs that stay as stiff."""
    away = ways - places
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    far = np.maximum(distance - SLACK, 0.0)
    behind = -away * far / np.maximum(distance, SLACK)  # from the goal, which is short of the way
    stiffness = BRISK * (1.0 + far / STIFFER)
    pull = speeds + stiffness * behind
    fade = np.exp(-stiffness * passed)
    moved = (behind + pull * passed) * fade - behind
    sped = (speeds - stiffness * pull * passed) * fade
    longest = np.linalg.norm(moved, axis=1, keepdims=True)
    most = FASTEST * passed
    share = np.where(longest > most, most / np.maximum(longest, 1e-12), 1.0)
    sped *= share
    sped[(far == 0.0)[:, 0] & (np.linalg.norm(sped, axis=1) < STILL)] = 0.0
    return places + moved * share, sped
