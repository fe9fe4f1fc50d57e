"""The setup of a match: everything that is needed to drive a puppet in the same way again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.mapping import Mapping
from runtime.driving.performer import Rest

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MatchSetup:
    """What a puppet is driven by, besides the poses of the performer.

    Attributes:
        rest: the performer's rest state; None while the puppet is not driven.
        mapping: which chains drive which; without drives where the anatomy tells that.
        view: (3, 3) rotation from the stage to the camera when the rest state was taken.
        matched: whether matches were stepped to in place of the anatomy's choice.
        gains: for each drive the share of the performer's turns that is carried over; () for all.
        by_hand: whether the user made the mapping, which goes before anatomy and matches.
    """

    rest: Rest | None
    mapping: Mapping
    view: Array
    matched: bool
    gains: tuple[float, ...]
    by_hand: bool = False

    def is_as(self, other: MatchSetup) -> bool:
        """Return whether the puppet moves alike: the rest state is the same one."""
        chosen = self.matched, self.by_hand
        mine = self.rest, self.mapping.drives, self.gains, chosen
        theirs = other.matched, other.by_hand
        return mine == (other.rest, other.mapping.drives, other.gains, theirs)
