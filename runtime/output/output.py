"""The interface of an output, and the frame that the loop hands to it."""

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
    """One solved frame of one character. Outputs must not change its arrays.

    Attributes:
        index: number of the frame in the show, from 0.
        time: [s], never decreasing; only differences have a meaning.
        vertices: (N, 3) [m] welded vertices of the character, on the stage. A later frame
            overwrites them: an output that keeps them copies them.
        nodes: the K nodes of the character's skeleton, on the stage; None where the driver poses
            none.
        poses: newest pose of each performer of the show, in the order of their slots; None for a
            performer who was not seen yet.
        weights: (T,) of the character's morph targets, which the vertices contain; None where it
            has none.
        picture: (H, W, 4) uint8 sRGB with straight alpha, top row first, or None when no output
            needs one for this frame.
    """

    index: int
    time: float
    vertices: NDArray[np.float64]
    nodes: PosedNodes | None
    poses: tuple[Pose | None, ...] = ()
    picture: NDArray[np.uint8] | None = None
    weights: NDArray[np.float64] | None = None

    def nodes_for(self, what: str) -> PosedNodes:
        """Return the posed nodes, for an output that requires them.

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
    """Stores or sends a performance, frame by frame.

    Every problem that can be known beforehand (a missing folder, a wrong suffix, a missing library)
    raises InputError in the constructor, before the show. `write` and `close` raise InputError when
    the disk fails. After `close` the file is whole and readable, however early `close` is called.
    """

    @property
    def pictures_a_second(self) -> float:
        """Pictures per second that the output needs: 0 for none, infinite for every frame."""
        ...

    def write(self, frame: PerformedFrame) -> None:
        """Store or send one frame."""
        ...

    def close(self) -> None:
        """Finish the file; may be called twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...


@runtime_checkable
class Screen(Protocol):
    """An output with live viewers: it also gets pictures while no performer is seen."""

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture, (H, W, 4) uint8 sRGB with straight alpha, top row first."""
        ...
