"""Joints that are believed again go to where they are seen within a moment; they do not jump."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

SECONDS = 0.15
FORGET = 0.5  # [s] without a frame after which nobody remembers where joints were shown
NEARLY = 0.02  # [m] that nobody sees as a jump

# Of each joint: when it was seen again, and how far from there it was shown then. In the frame
# before: where it was shown, and whether that was a guess.
_JOINT = np.dtype(
    [
        ("since", np.float64),
        ("off", np.float64, 3),
        ("shown", np.float64, 3),
        ("filled", np.bool_),
    ],
    align=True,
)


class Rejoining:
    """Leads the joints of one performer back from their guessed places.

    Args:
        joints: how many the skeleton has.
    """

    def __init__(self, joints: int) -> None:
        self._joints = np.zeros(joints, _JOINT)
        self.forget()

    def forget(self) -> None:
        """Show whatever comes next where it is."""
        self._at = float("nan")
        self._joints["since"] = -np.inf

    def lead(self, positions: Array, filled: Bools, time: float) -> tuple[Array, Bools]:
        """Where joints (J, 3) [m] are shown, and which (J,) of them are on their way.

        Args:
            positions: (J, 3) [m], all finite.
            filled: (J,) which of them are guesses.
            time: [s].
        """
        shown, on_the_way = positions.copy(), np.zeros(len(positions), dtype=np.bool_)
        if not abs(time - self._at) < FORGET:
            self._joints["filled"] = False
        _lead(self._joints, shown, filled, on_the_way, time)
        self._at = time
        return shown, on_the_way


@kernel
def _lead(joints: Records, positions: Array, filled: Bools, on_the_way: Bools, time: float) -> None:
    for index, joint in enumerate(joints):
        place = positions[index]
        if joint.filled and not filled[index]:
            joint.off[:] = joint.shown - place
            far = (joint.off**2).sum() > NEARLY**2
            joint.since = time if far else -np.inf
        passed = (time - joint.since) / SECONDS
        if 0.0 <= passed < 1.0 and not filled[index]:
            left = 1.0 - passed
            place += joint.off * (left * left * (3.0 - 2.0 * left))
            on_the_way[index] = True
        joint.shown[:] = place
        joint.filled = filled[index]
