"""Estimate the tilt and height of a depth camera, so that its frames can be levelled to y = 0.

A sensor's own floor plane gives tilt and height; an accelerometer gives the tilt only. If the
height is unknown, the floor is where feet have stood. All values are averaged over two seconds: a
moved camera is followed, and the noise of the plane does not reach the performer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.floor_height import FloorHeight
from solvers.signal.floor_plane import upright

Array = NDArray[np.float64]

MEMORY = 60  # frames in the average
STEEPEST = np.cos(np.radians(60.0))
HIGHEST = 5.0  # [m] largest height of a camera above the floor
USUAL_HEIGHT = 1.0  # [m] until the floor or a foot is seen


class CameraLevel:
    """The tilt and height of a camera, estimated frame by frame.

    Attributes:
        turn: (3, 3) rotation that levels world axes as the camera has them.
        height: [m] of the camera above the floor.
    """

    def __init__(self) -> None:
        self.turn: Array = np.eye(3)
        self.height = USUAL_HEIGHT
        self._up = np.zeros(3)
        self._seen = 0
        self._planes = 0
        self._floor = FloorHeight()

    def learn(self, up: Array, height: float = float("nan")) -> None:
        """Add a floor normal (3,) in the camera's world axes, and the camera's height [m] above the
        floor, NaN if unknown; implausible values are ignored."""
        length = float(np.linalg.norm(up))
        if not (0.5 < length < 2.0 and up[1] > STEEPEST * length):
            return
        self._seen += 1
        weight = max(1.0 / self._seen, 1.0 / MEMORY)
        self._up = self._up + weight * (up / length - self._up)
        self.turn = upright(self._up / np.linalg.norm(self._up))
        if 0.0 < height < HIGHEST:
            self._planes += 1
            self.height += max(1.0 / self._planes, 1.0 / MEMORY) * (height - self.height)

    def stand(self, lowest: float) -> None:
        """Add the levelled height [m] of a body's lowest foot relative to the camera, which is
        negative; it is used as long as no floor plane was seen."""
        if self._planes or not -HIGHEST < lowest < 0.0:
            return
        self._floor.add(lowest)
        self.height = -self._floor.value
