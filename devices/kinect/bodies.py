"""Convert the bodies that a Kinect reports to frames: code common to all Kinect versions.

Camera axes become ours as in `devices.kinect.joints`. `devices.bodies.camera_level` brings the
floor to y = 0 and level; the camera stands above the origin. Orientations keep the local axes that
the SDK gives a joint and are turned into the world; an all-zero quaternion means that there is
none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.camera_level import CameraLevel
from devices.bodies.performer_numbers import PerformerNumbers
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.clock_map import ClockMap
from solvers.skeleton.quaternions import followed_by

Array = NDArray[np.float64]

FURTHEST = 100.0  # [m] beyond the range of every depth camera
_SURE = 0.75  # confidence from which a foot indicates the floor


@dataclass(frozen=True, slots=True, eq=False)
class SensorBody:
    """One person in one frame.

    Attributes:
        id: the sensor's own number of the person.
        positions: (J, 3) [m] in camera axes.
        rotations: (J, 4) joint to camera, (x, y, z, w); all zero if there is none.
        confidence: (J,) in [0, 1]; 0 where the position is invalid.
    """

    id: int
    positions: Array
    rotations: Array
    confidence: Array


@dataclass(frozen=True, slots=True, eq=False)
class SensorFrame:
    """The bodies and the floor that a sensor saw at one moment.

    Attributes:
        time: [s] on the sensor's clock.
        bodies: all tracked people.
        up: (3,) the floor's normal in camera axes; all zero if unknown.
        height: [m] of the camera above the floor; NaN if unknown.
    """

    time: float
    bodies: Sequence[SensorBody]
    up: Array
    height: float = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """A Kinect version.

    Attributes:
        skeleton: its joints.
        to_world: (3, 3) camera axes to ours.
        feet: the joints that stand on the floor.
        read: decodes the bytes of one SDK frame; raises ValueError for other bytes.
    """

    skeleton: Skeleton
    to_world: Array
    feet: tuple[str, ...]
    read: Callable[[bytes], SensorFrame]


class KinectDecoder:
    """Frames of all people that a sensor sees, from the bytes of its SDK's frames.

    Args:
        sensor: the Kinect version.
        level: whether the floor is found and brought to y = 0; else the camera is the origin.

    Attributes:
        refused: packets that could not be decoded.
    """

    def __init__(self, sensor: Sensor, *, level: bool = True) -> None:
        self._sensor = sensor
        self._level = level
        self._floor = CameraLevel()
        self._numbers = PerformerNumbers()
        self._clock = ClockMap()
        self._feet = [sensor.skeleton.index(name) for name in sensor.feet]
        self.refused = 0

    @property
    def skeleton(self) -> Skeleton:
        """The sensor's joints."""
        return self._sensor.skeleton

    @np.errstate(over="ignore", invalid="ignore")  # values of a damaged packet
    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return a frame of each person in the SDK frame `data`, received at `arrival` [s]."""
        try:
            sensor_frame = self._sensor.read(data)
        except ValueError:
            self.refused += 1
            return []
        time = self._clock.host_time(sensor_frame.time, arrival)
        bodies = {body.id: _in_world(body, self._sensor.to_world) for body in sensor_frame.bodies}
        if self._level:
            self._learn_floor(sensor_frame, list(bodies.values()))
        numbers = self._numbers({body.id: _middle(body) for body in bodies.values()})
        return [
            self._frame(body, numbers[body.id], time, arrival)
            for body in sorted(bodies.values(), key=lambda body: numbers[body.id])
        ]

    def _learn_floor(self, sensor_frame: SensorFrame, bodies: Sequence[SensorBody]) -> None:
        self._floor.learn(self._sensor.to_world @ sensor_frame.up, sensor_frame.height)
        for body in bodies:
            feet = body.positions[self._feet][body.confidence[self._feet] > _SURE]
            if len(feet):
                self._floor.stand(float((feet @ self._floor.turn[1]).min()))

    def _frame(self, body: SensorBody, number: int, time: float, arrival: float) -> SkeletonFrame:
        turn, height = np.eye(3), 0.0
        if self._level:
            turn, height = self._floor.turn, self._floor.height
        return SkeletonFrame(
            time=time,
            positions=body.positions @ turn.T + [0.0, height, 0.0],
            rotations=_turned(body.rotations, turn @ self._sensor.to_world),
            confidence=body.confidence,
            performer=number,
            arrival=arrival,
        )


def _middle(body: SensorBody) -> Array:
    """(3,) [m] mean of the visible joints; NaN if there are none."""
    seen = body.positions[body.confidence > 0.0]
    return np.mean(seen, axis=0) if len(seen) else np.full(3, np.nan)


def _in_world(body: SensorBody, to_world: Array) -> SensorBody:
    """The body with positions in our axes; NaN and confidence 0 where a position is invalid. Its
    rotations still refer to the camera."""
    near = (np.abs(body.positions) < FURTHEST).all(axis=1)  # False for NaN
    seen = near & (body.confidence > 0.0) & (body.positions != 0.0).any(axis=1)
    positions = np.full_like(body.positions, np.nan)
    positions[seen] = body.positions[seen] @ to_world.T
    return replace(
        body,
        positions=positions,
        confidence=np.where(seen, np.clip(body.confidence, 0.0, 1.0), 0.0),
    )


def _turned(rotations: Array, turn: Array) -> Array:
    """Rotations (J, 4) followed by `turn` (3, 3); NaN where a quaternion is no rotation."""
    length = np.linalg.norm(rotations, axis=1)
    return followed_by(rotations, turn, known=(length > 0.5) & (length < 2.0))  # False for NaN
