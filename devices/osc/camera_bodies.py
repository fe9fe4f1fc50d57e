"""Convert bodies without reliable axes, units or floor: metres, upright, feet on y = 0.

A person before a depth camera faces it; the programs assume this when they name a hand the left
one. If a program does not state whether it mirrors, or whether y points down, the first poses
decide. If it does not state its unit, the torso gets the length of the built-in body's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.floor_height import FloorHeight
from devices.kinect.joints import KINECT_V2
from devices.osc.nimate_messages import JointFormat
from devices.osc.openni_joints import OPENNI

Array = NDArray[np.float64]

MOST_SIZES = 60  # frames in which the torso is measured; its length is constant afterwards
LEAST_TORSO = 1e-6  # units
FARTHEST = 1000.0  # [m] of a plausible position
_STUBBORN = 100.0  # torsos: bound of the evidence, so that later evidence can outweigh it

_HIPS, _NECK = KINECT_V2.index("SpineBase"), KINECT_V2.index("SpineShoulder")
_PAIRS = np.array(
    [
        [KINECT_V2.index(f"{joint}{side}") for side in ("Left", "Right")]
        for joint in ("Shoulder", "Hip")
    ]
)
_HIP_PAIR = _PAIRS[1]
_TORSO = float(
    np.linalg.norm(
        OPENNI.rest_positions[OPENNI.index("Neck")] - OPENNI.rest_positions[OPENNI.index("Pelvis")]
    )
)
_TURNED = np.array([-1.0, 1.0, -1.0])  # half a turn about Y: a person facing the sensor faces +Z

# OSCeleton maps 2.56 m by 1.92 m before the camera, and 1.28 m of depth, to 1; y points down.
_UNIT = np.array([2.56, -1.92, 1.28])
_MIDDLE = np.array([0.5, 0.5, 0.0])
_RAW = 20.0  # a larger depth occurs only in OSCeleton's raw mode, which has millimetres


class CameraBody:
    """One body as reported by a depth-camera program.

    Args:
        scale: [m] of the program's unit; None to derive it from the torso.
    """

    def __init__(self, scale: float | None = None) -> None:
        self._scale = scale
        self._sizes: list[float] = []
        self._ratio = 1.0  # [m] per unit, from the torso
        self._left = self._up = 0.0  # sums, in torsos, of how far left was at +x, and up at +y
        self._floor = FloorHeight()

    def place(self, positions: Array, format: JointFormat) -> Array:
        """Return Kinect's joints (25, 3) [m] in our axes, upright on the floor.

        Args:
            positions: (25, 3) as sent; NaN where not seen.
            format: the format, which determines axes and unit.
        """
        placed = _in_our_axes(positions, format)
        if np.isnan(placed[_HIPS]).any():
            placed[_HIPS] = placed[_HIP_PAIR].mean(axis=0)
        torso = _neck(placed) - placed[_HIPS]
        length = float(np.nan_to_num(np.linalg.norm(torso)))
        if length > LEAST_TORSO and format in (JointFormat.OSCELETON, JointFormat.ANIMATA):
            self._put_left_left(placed, length)
        if length > LEAST_TORSO and format is JointFormat.ANIMATA:
            self._put_upright(placed, torso[1] / length)
        placed[:, 1] -= self._floor_of(placed)
        placed *= self._unit(length, format)
        placed[~(np.abs(placed) < FARTHEST).all(axis=1)] = np.nan  # also where it is NaN
        return placed

    def _put_left_left(self, placed: Array, length: float) -> None:
        """Reflect a mirrored body in place; `length` of the torso."""
        side = float(np.nansum(placed[_PAIRS[:, 0], 0] - placed[_PAIRS[:, 1], 0])) / length
        self._left = float(np.clip(self._left + side, -_STUBBORN, _STUBBORN))
        if self._left < 0.0:
            placed[:, 0] *= -1.0

    def _put_upright(self, placed: Array, rise: float) -> None:
        """Reflect an inverted body in place; `rise` of the torso, relative to its length."""
        self._up = float(np.clip(self._up + rise, -_STUBBORN, _STUBBORN))
        if self._up < 0.0:
            placed[:, 1] *= -1.0

    def _unit(self, torso: float, format: JointFormat) -> float:
        if format is JointFormat.KINECT and self._scale is None:
            return 1.0
        if self._scale is not None:
            return self._scale
        if torso > LEAST_TORSO and len(self._sizes) < MOST_SIZES:
            self._sizes.append(torso)
            self._ratio = _TORSO / float(np.median(self._sizes))
        return self._ratio

    def _floor_of(self, placed: Array) -> float:
        """Height of the floor, including the lowest joint of this frame."""
        heights = placed[~np.isnan(placed[:, 1]), 1]
        if len(heights):
            self._floor.add(float(heights.min()))
        return self._floor.value


def _in_our_axes(positions: Array, format: JointFormat) -> Array:
    if format is JointFormat.ANIMATA:
        return positions.copy()
    if format is not JointFormat.OSCELETON:
        turned: Array = positions * _TURNED
        return turned
    raw = (np.abs(positions[:, 2]) > _RAW).any()
    metres = positions * 1e-3 if raw else (positions - _MIDDLE) * _UNIT
    seen: Array = metres * _TURNED
    return seen


def _neck(placed: Array) -> Array:
    """The middle of the shoulders (3,); NaN if they are not seen."""
    neck = placed[_NECK]
    between: Array = placed[_PAIRS[0]].mean(axis=0) if np.isnan(neck).any() else neck
    return between
