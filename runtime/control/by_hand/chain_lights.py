"""What lights up during mapping by hand: what can be clicked, and what the mouse points at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.control.by_hand.pickable import Part, Pickable
from runtime.driving.by_hand.choosing import Pair, Target
from runtime.puppet.puppet import Puppet
from runtime.show.lights import LitChain, pair_colours

FREE = np.array([0.55, 0.52, 0.47])  # linear RGB of a chain that nothing drives
BRIGHT = np.array([1.0, 0.93, 0.78])  # of one that is pointed at
SHARE = 0.45  # of it in the colour of a pair that is pointed at
THIN, USUAL, THICK = 0.45, 1.0, 1.4  # widths of chains that are free, paired, pointed at

Array = NDArray[np.float64]


class ChainLights:
    """Lights up the pairs in their colours, the free chains faintly, and some chains brightly.

    Args:
        pickable: the parts of performer and characters.
        puppets: the characters, from left to right.

    Attributes:
        pairs: those that are chosen.
        bright: the parts that are pointed at, or wait for their other half.
    """

    def __init__(self, pickable: Pickable, puppets: Sequence[Puppet]) -> None:
        self.pairs: Sequence[Pair] = ()
        self.bright: frozenset[Part] = frozenset()
        self._pickable, self._puppets = pickable, puppets

    def chains(self, number: int) -> list[LitChain]:
        """Return what lights up on a character; what is brighter lies on top."""
        places = self._puppets[number].places
        colours = self._colours()
        lit = []
        for chain in range(len(self._pickable.character(number).chains)):
            target = Target(number, chain)
            colour, width = colours.get(target, FREE), USUAL if target in colours else THIN
            if target in self.bright:
                colour, width = _brighter(colours.get(target)), THICK
            lit.append(LitChain(places[list(self._pickable.nodes(target))], colour, width))
        return sorted(lit, key=lambda each: each.width)

    def joint_colours(self, joints: int) -> Array:
        """Return linear RGB of each joint of the performer (J, 3), NaN where it has none."""
        of_target = self._colours()
        of_source = {pair.source: of_target[pair.target] for pair in self.pairs}
        colours = np.full((joints, 3), np.nan)
        for source, chain in enumerate(self._pickable.performer.chains):
            colour = of_source.get(source)
            if source in self.bright:
                colour = _brighter(colour)
            if colour is not None:
                colours[list(chain[1:])] = colour
        return colours

    def _colours(self) -> dict[Target, Array]:
        chains = self._pickable.performer.chains
        colours = pair_colours([chains[pair.source][1:] for pair in self.pairs])
        return {pair.target: own for pair, own in zip(self.pairs, colours, strict=True)}


def _brighter(colour: Array | None) -> Array:
    return BRIGHT if colour is None else (1.0 - SHARE) * colour + SHARE * BRIGHT
