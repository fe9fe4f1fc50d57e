"""What lights up on characters and performer in place of the driven chains."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from runtime.render.tubes import PAIR_COLOURS

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LitChain:
    """A polyline that lights up on a character.

    Attributes:
        points: (k, 3) [m], in the character's coordinates.
        colour: (3,) linear RGB.
        width: times the usual width.
    """

    points: Array
    colour: Array
    width: float


class Lights(Protocol):
    """Lights up chains, as while they are chosen by hand; outputs never show it."""

    def chains(self, number: int) -> Sequence[LitChain]:
        """Return what lights up on a character, by its number; the last lies on top."""
        ...

    def joint_colours(self, joints: int) -> Array:
        """Return linear RGB of each joint of the performer (J, 3), NaN where it has none."""
        ...


def colour_numbers(sources: Sequence[Hashable]) -> list[int]:
    """Return the number of each pair's colour: pairs with one source have one colour."""
    order = {source: number for number, source in enumerate(dict.fromkeys(sources))}
    return [order[source] for source in sources]


def pair_colours(sources: Sequence[Hashable]) -> Array:
    """Return linear RGB (P, 3) of pairs, by what drives each."""
    numbers = np.array(colour_numbers(sources), dtype=np.int64)
    colours: Array = PAIR_COLOURS[numbers % len(PAIR_COLOURS)]
    return colours
