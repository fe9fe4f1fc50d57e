"""A count-in: seconds that are counted down before a take or a rest pose, by the show's time."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum

LENGTHS = (0.0, 3.0, 5.0, 10.0)  # [s] that one press after another goes through
MOST = 10.0  # [s] at the upper end of the fader
LONGEST_STEP = 0.25  # [s] that a frame counts for at most
NOTHING_LEFT = 1e-6  # [s] a count-in is not later by a frame for a rounding error


class Counted(Enum):
    """What a count-in leads to, in words."""

    TAKE = "The take starts"
    REST = "The rest pose is taken"


class CountIn:
    """Counts seconds down by the times of the frames that the show performs.

    While no frame comes, it waits.

    Args:
        seconds: how long it lasts [s]; 0 for none.

    Attributes:
        seconds: as given; may be set.
        counted: what it leads to; None while nothing is counted.
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self.seconds = seconds
        self.counted: Counted | None = None
        self._left = 0.0
        self._at = math.nan
        self._then: Callable[[], None] = _nothing

    @property
    def left(self) -> float | None:
        """[s] until zero; None while nothing is counted."""
        return None if self.counted is None else self._left

    def begin(self, counted: Counted, then: Callable[[], None]) -> None:
        """Count down from now on.

        Args:
            counted: what it leads to.
            then: begins it, just before the first frame at zero or later is performed.
        """
        self.counted, self._then, self._left = counted, then, self.seconds

    def end(self) -> bool:
        """End it before zero; return whether anything was counted."""
        counting, self.counted = self.counted is not None, None
        return counting

    def follow(self, time: float) -> None:
        """Go on to a frame that is about to be performed; at zero begin what was counted for.

        Args:
            time: [s] of the frame.
        """
        passed, self._at = time - self._at, time
        if self.counted is None or math.isnan(passed):
            return
        self._left -= min(max(passed, 0.0), LONGEST_STEP)
        if self._left <= NOTHING_LEFT:
            self.counted = None
            self._then()

    def lengthen(self) -> None:
        """Go on to the next of the usual lengths; after the longest to none."""
        self.seconds = next((each for each in LENGTHS if each > self.seconds), LENGTHS[0])


def _nothing() -> None:
    """Begin nothing."""
