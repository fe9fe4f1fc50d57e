"""Landmarks in other spaces than MediaPipe's: triangulated by FreeMoCap, or turned when saved."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from replay.mediapipe.landmarks import track
from replay.orientation import up_to_y
from replay.stated import Stated

Array = NDArray[np.float64]

_UNITS = {"m": (0.1, 1.0, 1.0), "cm": (10.0, 100.0, 0.01), "mm": (100.0, 1000.0, 0.001)}
# Width of shoulders in each unit from which to which it is that unit, and its metres.
_ABOVE = (("left_shoulder", "right_shoulder"), ("left_hip", "right_hip"))
_IN_IMAGE = np.array([0.0, -1.0, 0.0])  # the up axis of images and of MediaPipe's world
_TO_LANDMARKS = np.diag([1.0, -1.0, -1.0])


def in_landmark_axes(
    tracks: Mapping[str, Array], stated: Stated, notes: list[str]
) -> dict[str, Array] | None:
    """Return landmarks of a room in metres and MediaPipe's axes; None if they are of an image.

    Images have y down. Where bodies stand along another axis, their landmarks were measured in a
    room: FreeMoCap has millimetres, z up. `stated` decides axis and unit instead.

    Args:
        tracks: (T, 4) by landmark, in the file's axes and unit.
        stated: the up axis and unit that are known.
        notes: assumptions are added.
    """
    up = stated.up_axis
    if up is None:
        up = _up(tracks)
        if up is None or (up == _IN_IMAGE).all():
            return None
        name = f"{'-+'[int(up.sum() > 0)]}{'XYZ'[int(np.argmax(np.abs(up)))]}"
        notes.append(f"landmarks of a room: up axis is {name} (--up-input AXIS)")
    metres = stated.metres or _metres(tracks, notes)
    turn = metres * _TO_LANDMARKS @ up_to_y(up)
    return {name: track(found[:, :3] @ turn.T, found[:, 3]) for name, found in tracks.items()}


def _middle(tracks: Mapping[str, Array], pair: tuple[str, str]) -> Array | None:
    if not all(name in tracks for name in pair):
        return None
    middle: Array = 0.5 * (tracks[pair[0]] + tracks[pair[1]])[:, :3]
    return middle


def _up(tracks: Mapping[str, Array]) -> Array | None:
    """The axis (3,) nearest to the way from hips to shoulders; None if they are not seen."""
    shoulders, hips = (_middle(tracks, pair) for pair in _ABOVE)
    if shoulders is None or hips is None:
        return None
    rise = shoulders - hips
    rise = rise[np.isfinite(rise).all(axis=1)]
    if not len(rise):
        return None
    mean = np.median(rise, axis=0)
    largest = int(np.argmax(np.abs(mean)))
    if largest == 0:  # lying, in an image
        return None
    axis = np.zeros(3)
    axis[largest] = np.sign(mean[largest])
    return axis if axis.any() else None


def _metres(tracks: Mapping[str, Array], notes: list[str]) -> float:
    """Metres per unit, from the width of the shoulders."""
    left, right = (tracks[name][:, :3] for name in _ABOVE[0] if name in tracks)
    width = float(np.nanmedian(np.linalg.norm(left - right, axis=1)))
    for unit, (least, most, metres) in _UNITS.items():
        if least <= width < most:
            notes.append(f"unit guessed: {unit} (--unit-input UNIT)")
            return metres
    notes.append("unit unknown, scaled to shoulders of 0.36 m (--unit-input UNIT)")
    return 0.36 / width if width > 0 else 1.0
