"""The pairs that a person chooses click by click, as immutable values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

from runtime.driving.by_hand.parts import Parts
from runtime.driving.driver import DrivenPart
from runtime.driving.mapping import Drive, Mapping
from runtime.puppet.bound_skeleton import BoundSkeleton


class End(Enum):
    """Whose chain is clicked on."""

    PERFORMER = "performer"
    CHARACTER = "character"


@dataclass(frozen=True, slots=True)
class Target:
    """A chain of a character.

    Attributes:
        character: its number, from the left of the stage.
        chain: the number of the chain among its parts.
    """

    character: int
    chain: int


@dataclass(frozen=True, slots=True)
class Pair:
    """A chain of the performer that drives a chain of a character."""

    source: int
    target: Target


@dataclass(frozen=True, slots=True)
class Choosing:
    """What was chosen so far. It is never changed: each click returns the next one.

    Attributes:
        pairs: in the order in which they were made. No target is in two of them.
        source: the performer's chain that waits for a part of a character; None for none.
        targets: the character's chains that wait for a part of the performer; () for none.
    """

    pairs: tuple[Pair, ...] = ()
    source: int | None = None
    targets: tuple[Target, ...] = ()

    def click_performer(self, chain: int) -> Choosing:
        """Return what is chosen after a click on a chain of the performer."""
        if self.targets:
            return self._joined(chain, self.targets)
        return replace(self, source=None if chain == self.source else chain)

    def click_character(self, targets: Sequence[Target]) -> Choosing:
        """Return what is chosen after a click on a chain of a character.

        Args:
            targets: the chain, and those that are taken together with it, in their order.
        """
        if self.source is not None:
            return self._joined(self.source, tuple(targets))
        taken = () if set(targets) & set(self.targets) else tuple(targets)
        return replace(self, targets=taken)

    def _joined(self, source: int, targets: tuple[Target, ...]) -> Choosing:
        """Pairs that are all there are taken away; else they are made."""
        wanted = [Pair(source, target) for target in targets]
        others = tuple(pair for pair in self.pairs if pair.target not in targets)
        if all(pair in self.pairs for pair in wanted):
            return Choosing(others)
        return Choosing((*others, *wanted))

    def released(self) -> Choosing:
        """Return the same pairs, without a chain that waits for its partner."""
        return Choosing(self.pairs)

    def cleared(self, character: int) -> Choosing:
        """Return what is chosen without the pairs of a character."""
        return Choosing(tuple(p for p in self.pairs if p.target.character != character))

    def of(self, character: int) -> tuple[Pair, ...]:
        """The pairs of one character."""
        return tuple(pair for pair in self.pairs if pair.target.character == character)


def pairs_of(
    driven: Sequence[DrivenPart], character: int, performer: Parts, parts: Parts
) -> tuple[Pair, ...]:
    """Return the pairs most like the drives of a character; drives unlike any pair are left out.

    Args:
        driven: what drives what.
        character: its number.
        performer: the parts of the performer.
        parts: the parts of the character.
    """
    pairs: dict[int, Pair] = {}
    for part in driven:
        source, target = performer.nearest(part.source), parts.nearest(part.target)
        if source is not None and target is not None:
            pairs.setdefault(target, Pair(source, Target(character, target)))
    return tuple(pairs.values())


def mapping_of(
    pairs: Sequence[Pair], performer: Parts, parts: Parts, bound: BoundSkeleton, phase: float = 0.0
) -> Mapping:
    """Return the mapping of the pairs of one character.

    Each chain is driven outside the trunk only, as a matched one is. Where one chain of the
    performer drives several, each follows `phase` later than the one before.

    Args:
        pairs: of one character, at least one.
        performer: the parts of the performer.
        parts: the parts of the character.
        bound: the character's nodes, bound to its surface.
        phase: [s].
    """
    drives = [
        Drive(performer.chains[pair.source], bound.limb(parts.chains[pair.target.chain]))
        for pair in pairs
    ]
    return spread_out(Mapping(tuple(drives)), phase)


def spread_out(mapping: Mapping, phase: float) -> Mapping:
    """Return a mapping in which chains with one source follow one `phase` [s] after the other."""
    before: dict[tuple[int, ...], int] = {}
    drives = []
    for drive in mapping.drives:
        place = before[drive.source] = before.get(drive.source, -1) + 1
        drives.append(replace(drive, delay=place * phase))
    return replace(mapping, drives=tuple(drives))


def phase_of(mapping: Mapping) -> float:
    """Return the phase [s] of a mapping: how much later the second chain of a group follows."""
    sources = [drive.source for drive in mapping.drives]
    delays = [drive.delay for drive in mapping.drives if sources.count(drive.source) > 1]
    return min((delay for delay in delays if delay > 0.0), default=0.0)


def has_group(mapping: Mapping) -> bool:
    """Whether one chain of the performer drives several of the character."""
    return len({drive.source for drive in mapping.drives}) < len(mapping.drives)
