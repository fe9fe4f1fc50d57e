"""What the frame loop hands to everything that keeps a performance, and how it does so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class PerformedFrame:
    """One tick of one character's performance, everything solved; nobody changes its arrays.

    Attributes:
        index: counts the frames of the show from 0.
        time: the performance's time [s], never falling; only differences count.
        vertices: (N, 3) [m] welded vertices of the character, on the stage; who keeps them copies
            them, since a later frame overwrites them.
        node_positions: (K, 3) [m] where the nodes of the character's skeleton are, on the stage.
        node_rotations: (K, 4) unit quaternions (x, y, z, w), world, of each node since its rest
            pose: all of them (0, 0, 0, 1) at rest.
        picture: (H, W, 4) uint8 sRGB with straight alpha, top row first, or None when nobody needs
            one of this frame.
    """

    index: int
    time: float
    vertices: NDArray[np.float64]
    node_positions: NDArray[np.float64]
    node_rotations: NDArray[np.float64]
    picture: NDArray[np.uint8] | None = None


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
