"""Joints that are seen again move from their guessed place to the seen one; they do not jump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.short_loops import put

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

SECONDS = 0.15
FORGET = 0.5  # [s] without a frame after which the places shown are forgotten
NEARLY = 0.02  # [m] a step too small to look like a jump

# Of each joint: when it was seen again, and the way from the seen place to the one shown then. In
# the frame before: the place shown, and whether that was a guess.
_JOINT = np.dtype(
    [
        ("since", np.float64),
        ("off", np.float64, 3),
        ("shown", np.float64, 3),
        ("filled", np.bool_),
    ],
    align=True,
)


@dataclass(frozen=True, slots=True, eq=False)
class RejoiningState:
    """The memory of one performer's rejoining: (J,) of `_JOINT`, and the last frame's time [s]."""

    joints: Records
    at: float


class Rejoining:
    """Moves the joints of one performer back from their guessed places within `SECONDS`.

    Args:
        joints: the skeleton's number of joints.
    """

    def __init__(self, joints: int) -> None:
        self._joints = np.zeros(joints, _JOINT)
        self.forget()

    def forget(self) -> None:
        """Show the next frame as it is."""
        self._at = float("nan")
        self._joints["since"] = -np.inf

    def snapshot(self) -> RejoiningState:
        """Return a copy of the memory."""
        return RejoiningState(self._joints.copy(), self._at)

    def restore(self, state: RejoiningState) -> None:
        """Go back to a snapshot."""
        self._joints[:], self._at = state.joints, state.at

    def blend(self, positions: Array, filled: Bools, time: float) -> tuple[Array, Bools]:
        """Return the places to show (J, 3) [m], and which joints (J,) are on their way.

        Args:
            positions: (J, 3) [m], all finite.
            filled: (J,) which of them are guesses.
            time: [s].
        """
        shown, on_the_way = positions.copy(), np.zeros(len(positions), dtype=np.bool_)
        if not abs(time - self._at) < FORGET:
            self._joints["filled"] = False
        _move_back(self._joints, shown, filled, on_the_way, time)
        self._at = time
        return shown, on_the_way


@kernel
def _move_back(
    joints: Records, positions: Array, filled: Bools, on_the_way: Bools, time: float
) -> None:
    for index, joint in enumerate(joints):
        place = positions[index]
        if joint.filled and not filled[index]:
            put(joint.off, joint.shown - place)
            far = (joint.off**2).sum() > NEARLY**2
            joint.since = time if far else -np.inf
        passed = (time - joint.since) / SECONDS
        if 0.0 <= passed < 1.0 and not filled[index]:
            left = 1.0 - passed
            place += joint.off * (left * left * (3.0 - 2.0 * left))
            on_the_way[index] = True
        put(joint.shown, place)
        joint.filled = filled[index]
