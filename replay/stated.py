"""What a user says of a recording that its file does not say: rate, up axis, unit, mirroring."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.joint_labels import label_joints, partners
from devices.errors import InputError
from replay.recording import Recording

Array = NDArray[np.float64]

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Metres of each unit that can be stated."""

AXES = ("x", "y", "z", "-x", "-y", "-z")
"""The axes that can be stated to point up."""

_ACROSS = np.array([-1.0, 1.0, 1.0])
_TURNED = np.array([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Stated:
    """What is known of a recording beside its file; None is guessed by the reader, with a note.

    Attributes:
        rate: frames per second, in place of the file's times.
        up: of `AXES`, the file's axis that points up.
        unit: of `METRES`, the file's unit of length.
        mirrored: the file shows the performer as in a mirror.
        animation: which of the file's animations is meant: its name, or its number from 1.

    Raises:
        InputError: there is no such unit or axis.
    """

    rate: float | None = None
    up: str | None = None
    unit: str | None = None
    mirrored: bool = False
    animation: str | None = None

    def __post_init__(self) -> None:
        if self.unit is not None and self.unit not in METRES:
            raise InputError(f"{self.unit!r} is no unit of length; use {', '.join(METRES)}")
        if self.up is not None and self.up not in AXES:
            raise InputError(f"{self.up!r} is no axis; use {', '.join(AXES)}")

    @property
    def up_axis(self) -> Array | None:
        """The stated up axis as a unit vector (3,)."""
        if self.up is None:
            return None
        axis: Array = np.eye(3)["xyz".index(self.up[-1])] * (-1.0 if self.up[0] == "-" else 1.0)
        return axis

    @property
    def metres(self) -> float | None:
        """Metres per unit of the file."""
        return None if self.unit is None else METRES[self.unit]

    def applied(self, recording: Recording) -> Recording:
        """The recording at the stated rate, unmirrored; readers have applied axis and unit.

        Frames of the same time stay together.
        """
        if self.rate is not None:
            _, number = np.unique(recording.times, return_inverse=True)
            recording = replace(recording, times=number.reshape(-1) / self.rate)
        return _unmirrored(recording) if self.mirrored else recording


UNSTATED = Stated()
"""Nothing is stated, and everything guessed."""


def _unmirrored(recording: Recording) -> Recording:
    """The recording with left and right exchanged, in names and in space."""
    partner = partners(recording.skeleton, label_joints(recording.skeleton))
    rotations = recording.rotations
    return replace(
        recording,
        positions=recording.positions[:, partner] * _ACROSS,
        rotations=None if rotations is None else rotations[:, partner] * _TURNED,
        confidence=recording.confidence[:, partner],
    )
