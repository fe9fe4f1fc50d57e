"""Levelling what a tilted camera sees, so that the floor is y = 0.

A sensor's own floor plane says where the floor is and how the camera is tilted; an accelerometer
says the tilt only. Where the height is not known, the floor is where feet have stood. All of it is
averaged over two seconds: a camera that is moved is followed, and nobody shakes with the noise of
a plane.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

MEMORY = 60  # frames that are averaged
STEEPEST = np.cos(np.radians(60.0))
HIGHEST = 5.0  # [m] above the floor that a camera stands at most
USUAL_HEIGHT = 1.0  # [m] until the floor or a foot was seen
_FEET = 150  # heights of feet that are remembered
_STANDING = 5.0  # percentile of them that is the floor: below it feet were tracked badly


class CameraLevel:
    """The tilt and height of a camera, learnt frame by frame.

    Attributes:
        turn: (3, 3) rotation that brings world axes as the camera has them upright.
        height: [m] of the camera above the floor.
    """

    def __init__(self) -> None:
        self.turn: Array = np.eye(3)
        self.height = USUAL_HEIGHT
        self._up = np.zeros(3)
        self._seen = 0
        self._planes = 0
        self._feet: list[float] = []

    def learn(self, up: Array, height: float = float("nan")) -> None:
        """Take in a floor's normal (3,), in the camera's world axes, and the camera's height [m]
        above it, NaN where only the direction is known; what cannot be is passed over."""
        length = float(np.linalg.norm(up))
        if not (0.5 < length < 2.0 and up[1] > STEEPEST * length):
            return
        self._seen += 1
        weight = max(1.0 / self._seen, 1.0 / MEMORY)
        self._up = self._up + weight * (up / length - self._up)
        self.turn = _upright(self._up / np.linalg.norm(self._up))
        if 0.0 < height < HIGHEST:
            self._planes += 1
            self.height += max(1.0 / self._planes, 1.0 / MEMORY) * (height - self.height)

    def stand(self, lowest: float) -> None:
        """Take in how high [m], levelled, above the camera the lowest foot of a body is (so below
        0 of course); it counts while no floor was ever seen."""
        if self._planes or not -HIGHEST < lowest < 0.0:
            return
        self._feet = [*self._feet[-_FEET + 1 :], lowest]
        self.height = -float(np.percentile(self._feet, _STANDING))


def _upright(up: Array) -> Array:
    """The least rotation (3, 3) that turns the unit vector `up` to +Y."""
    axis = np.cross(up, [0.0, 1.0, 0.0])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    turn: Array = Rotation.from_rotvec(axis / sine * np.arctan2(sine, up[1])).as_matrix()
    return turn
