"""What the frame loop hands to everything that keeps a performance, and how it does so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.driving.performer import Pose
from runtime.driving.targets import PosedNodes


@dataclass(frozen=True, slots=True, eq=False)
class PerformedFrame:
    """One tick of one character's performance, everything solved; nobody changes its arrays.

    Attributes:
        index: counts the frames of the show from 0.
        time: the performance's time [s], never falling; only differences count.
        vertices: (N, 3) [m] welded vertices of the character, on the stage; who keeps them copies
            them, since a later frame overwrites them.
        nodes: the K nodes of the character's skeleton, on the stage; None where the driver poses
            none.
        poses: newest pose of each performer of the show, in the order of their slots; None for one
            who has not come yet.
        picture: (H, W, 4) uint8 sRGB with straight alpha, top row first, or None when nobody needs
            one of this frame.
    """

    index: int
    time: float
    vertices: NDArray[np.float64]
    nodes: PosedNodes | None
    poses: tuple[Pose | None, ...] = ()
    picture: NDArray[np.uint8] | None = None

    def nodes_for(self, what: str) -> PosedNodes:
        """Return the posed nodes, for an output that cannot do without them.

        Args:
            what: the output, for the message.

        Raises:
            InputError: the driver poses no nodes.
        """
        if self.nodes is None:
            raise InputError(
                f"{what} needs the posed nodes of a skeleton, and this character's driver poses "
                "none: write its surface with --cache or a .usdc, or choose another driver"
            )
        return self.nodes


class Output(Protocol):
    """Something that keeps a performance, frame by frame.

    Whatever can be known to fail (no such folder, a wrong suffix, a missing library) fails in the
    constructor, before the show. `write` and `close` raise InputError when the disk fails. What
    was written is whole and readable after `close`, however early that comes.
    """

    @property
    def pictures_a_second(self) -> float:
        """How many frames in a second must come with their picture: 0 none, infinite all."""
        ...

    def write(self, frame: PerformedFrame) -> None:
        """Keep one frame."""
        ...

    def close(self) -> None:
        """Finish the file; may be called twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...


@runtime_checkable
class Screen(Protocol):
    """An output for viewers elsewhere, who see a picture also while no performer is seen."""

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture, (H, W, 4) uint8 sRGB with straight alpha, top row first."""
        ...
