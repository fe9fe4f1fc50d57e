"""The interface of a driver: it turns the poses of a performer into targets for a character."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from runtime.driving.mapping import Mapping
from runtime.driving.performer import Pose, Rest
from runtime.driving.targets import Targets

Array = NDArray[np.float64]

ABSOLUTE, RELATIVE = "absolute", "relative"
"""The two ways in which a part is driven: see `DrivenPart`."""


@dataclass(frozen=True, slots=True)
class Needs:
    """What a driver needs from the source of motion.

    Attributes:
        clip: whether it needs the whole clip before the first frame, and so a recording.
        surface: whether it needs a surface of the performer at every frame, besides the skeleton.
    """

    clip: bool = False
    surface: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Highlight:
    """A polyline that lights up on a character, and the joints that light up with it.

    Attributes:
        points: (k, 3) [m].
        joints: joints of the performer, at the far ends of the bones that have the same colour.
    """

    points: Array
    joints: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class DrivenPart:
    """A part of the performer that drives a part of the character.

    Attributes:
        name: of the performer's part, in words: "left arm".
        target_name: of the character's part: "left wing".
        source: joints of the performer, from the trunk outward.
        target: nodes of the character, from the trunk outward.
        drive: how: "absolute" points where the performer's part points, "relative" turns from the
            rest pose as the performer's part turns.
        gain: share of the performer's motion that is carried over, in (0, 1].
        flip: whether the turns are mirrored.
        delay: [s] how much later it follows.
    """

    name: str
    target_name: str
    source: tuple[int, ...]
    target: tuple[int, ...]
    drive: str
    gain: float = 1.0
    flip: bool = False
    delay: float = 0.0

    def __str__(self) -> str:
        later = f", {self.delay:.2f} s later" if self.delay > 0.0 else ""
        share = f"{100.0 * self.gain:.0f} %"
        return f"{self.name} -> {self.target_name}, {self.drive}, {share}{later}"


class Driver(Protocol):
    """Moves one character. Drivers can be switched while a show runs."""

    @property
    @abstractmethod
    def needs(self) -> Needs:
        """What the source of motion must provide."""
        ...

    @property
    @abstractmethod
    def poses_nodes(self) -> bool:
        """Whether the targets have posed nodes, which exports of a skeleton require."""
        ...

    @property
    @abstractmethod
    def highlights(self) -> Sequence[Highlight]:
        """The polylines to light up, before the placement, in the order of their colours."""
        ...

    @property
    @abstractmethod
    def parts(self) -> Sequence[DrivenPart]:
        """What drives what, in words and numbers, for people and for the report."""
        ...

    @abstractmethod
    def prepare(self, clip: Sequence[Pose], rest: Rest | None) -> None:
        """Start to drive.

        Args:
            clip: poses of the recording that will be played: all of them if `needs.clip`, else a
                selection; empty for a live stream.
            rest: the performer's pose at the rest pose of the character; None to stop driving, so
                that the targets are the rest pose.

        Raises:
            InputError: the character cannot be driven so; nothing changes then.
        """
        ...

    @abstractmethod
    def targets(self, pose: Pose) -> Targets:
        """Return the targets for the performer's newest pose."""
        ...

    @abstractmethod
    def reset(self) -> None:
        """Forget the poses before, as after a cut. What was prepared stays."""
        ...

    @abstractmethod
    def snapshot(self) -> Any:
        """Return everything that is remembered between frames, as an immutable value."""
        ...

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Go back to the state of a snapshot."""
        ...


@dataclass(frozen=True, slots=True)
class StretchLimits:
    """How far edges may stretch in a rehearsal before limbs turn by less than the performer's.

    Attributes:
        of_all: bound on the 99th percentile of all edges in all poses.
        of_limb: bound on the 95th percentile of the edges at one limb in any one pose.
    """

    of_all: float = 0.4
    of_limb: float = 0.4


class MappedDriver(Driver):
    """A driver that carries motion from chains of joints over to chains of nodes.

    Attributes:
        limits: how far the surface may stretch at full gains.
        mapping: the mapping that drives, or that is shown.
        gains: (D,) for each drive the share of the performer's turns that is carried over, in
            (0, 1].
    """

    limits: StretchLimits
    mapping: Mapping
    gains: Array

    @abstractmethod
    def show(self, mapping: Mapping, view: Array) -> None:
        """Show a mapping without being driven by it; the next `prepare` uses it.

        Args:
            mapping: which joints drive which nodes.
            view: (3, 3) rotation from the stage to the camera.
        """
        ...

    @abstractmethod
    def pulls(self) -> NDArray[np.bool_]:
        """Return which of D drives pull at each edge (E, D) of the deformed surface."""
        ...
