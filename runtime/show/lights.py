"""Colours on characters and performer that show which chains are driven or can be chosen."""

from __future__ import annotations

from collections.abc import Sequence
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
    """Lights up chains, for example during mapping by hand; outputs never show it."""

    def chains(self, number: int) -> Sequence[LitChain]:
        """Return what lights up on a character, by its number; the last lies on top."""
        ...

    def joint_colours(self, joints: int) -> Array:
        """Return linear RGB of each joint of the performer (J, 3), NaN where it has none."""
        ...


def colour_numbers(sources: Sequence[Sequence[int]]) -> list[int]:
    """Return the number of each pair's colour: one for each part of the performer.

    Two chains are of one part where one of them holds the tip of the other, as an arm to the wrist
    and an arm to the fingertips do.

    Args:
        sources: of each pair the joints that drive it, without the one that the chain starts from.
    """
    parts: list[tuple[set[int], set[int]]] = []  # of each colour the joints and the tips
    numbers = []
    for source in sources:
        joints, tip = set(source), set(source[-1:])
        number = next(
            (n for n, (known, tips) in enumerate(parts) if tip & known or tips & joints),
            len(parts),
        )
        if number == len(parts):
            parts.append((set(), set()))
        parts[number][0].update(joints)
        parts[number][1].update(tip)
        numbers.append(number)
    return numbers


def pair_colours(sources: Sequence[Sequence[int]]) -> Array:
    """Return linear RGB (P, 3) of pairs, by the joints that drive each: see `colour_numbers`."""
    numbers = np.array(colour_numbers(sources), dtype=np.int64)
    colours: Array = PAIR_COLOURS[numbers % len(PAIR_COLOURS)]
    return colours
