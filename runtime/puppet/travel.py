"""How far a character travels over the stage with its performer: all of the way, or none.

Between both it is eased, so that no character jumps when a puppeteer changes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from runtime.driving.targets import Placement

SECONDS = 0.5  # from staying in place to going the whole way, or back
LONGEST_STEP = 0.1  # [s] that a frame counts for at most


@dataclass(frozen=True, slots=True)
class TravelState:
    """The state of a `Travel` between two frames.

    Attributes:
        share: how far the change from in place (0) to the whole way (1) has come, evenly in time.
        at: [s] of the last frame; NaN before the first one.
    """

    share: float
    at: float


class Travel:
    """Takes the travel out of placements while a character stays in place.

    Attributes:
        in_place: whether the character is to stay where it is; a puppeteer may change it.
    """

    def __init__(self) -> None:
        self.in_place = False
        self._share = 1.0
        self._at = math.nan

    def follow(self, time: float) -> None:
        """Go on to a frame at `time` [s]; the first one is not eased, nor is one without a time."""
        goal = 0.0 if self.in_place else 1.0
        passed = time - self._at
        if math.isnan(passed):
            self._share = goal
        else:
            step = min(max(passed, 0.0), LONGEST_STEP) / SECONDS
            self._share += min(max(goal - self._share, -step), step)
        self._at = time

    def of(self, placement: Placement) -> Placement:
        """Return a placement that travels as far as the character goes now."""
        if self._share == 1.0:
            return placement
        share = self._share * self._share * (3.0 - 2.0 * self._share)
        x, z = placement.travel
        return replace(placement, travel=(share * x, share * z))

    def reset(self) -> None:
        """Forget the frames before: what was set holds at once."""
        self._at = math.nan

    def snapshot(self) -> TravelState:
        """Return what is remembered between frames."""
        return TravelState(self._share, self._at)

    def restore(self, state: TravelState) -> None:
        """Go back to a snapshot."""
        self._share, self._at = state.share, state.at
