"""What a puppeteer has chosen for matching, and the match that is shown."""

from __future__ import annotations

import math
from dataclasses import dataclass

from runtime.driving.mapping import Mapping


@dataclass(frozen=True, slots=True)
class Choices:
    """The settings of the matching that a puppeteer can choose.

    Attributes:
        rank: which match is shown first, 1 the best.
        extend: drive a chain on to its longest leaf, or stop at the sub-tree's root (figure 5).
        flip: turn the targets' y-axes round (section 5.2).
        patience: [s] that the performer must keep a pose, with the same match shown, before it
            performs by itself; 0 at once, infinite only when accepted.
        again: the same, for a puppet that performs already and is matched again; None for the
            same patience.
        stray: share of the performer's size that a joint may stray from a pose that counts as kept.
    """

    rank: int = 1
    extend: bool = True
    flip: bool = False
    patience: float = 0.0
    again: float | None = None
    stray: float = math.inf


@dataclass(frozen=True, slots=True, eq=False)
class OwnChoice:
    """What the user chose for one puppet, in place of what is usual.

    Attributes:
        stepped: whether matches were stepped to in place of the anatomy's choice.
        by_hand: the mapping that the user made; None without one.
    """

    stepped: bool = False
    by_hand: Mapping | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """The match that is shown, among those that can be cycled through.

    Attributes:
        rank: 1 for the best; 0 if it is not among them, as a mapping by hand.
        count: how many there are.
        score: of AniMesh's equation 4.
    """

    rank: int
    count: int
    score: float
