"""The mapping that pairs in words stand for."""

from __future__ import annotations

from collections.abc import Sequence

from devices.errors import InputError
from runtime.driving.by_hand.choosing import Pair, Target, mapping_of
from runtime.driving.by_hand.pair_words import WordedPair
from runtime.driving.by_hand.parts import Parts
from runtime.driving.mapping import Mapping
from runtime.puppet.bound_skeleton import BoundSkeleton


def mapping_in_words(
    pairs: Sequence[WordedPair],
    character: str,
    performer: Parts,
    parts: Parts,
    bound: BoundSkeleton,
) -> Mapping | None:
    """Return the mapping of one character that pairs in words stand for; None where none is its.

    Args:
        pairs: of all characters.
        character: its name.
        performer: the parts of the performer.
        parts: the parts of the character.
        bound: the character's nodes, bound to its surface.

    Raises:
        InputError: a part is not known, or driven twice.
    """
    made: list[Pair] = []
    for pair in pairs:
        target = pair.target_of(character)
        if target is None:
            continue
        chain = _named(parts, target, character)
        if any(other.target.chain == chain for other in made):
            raise InputError(f"{parts.names[chain]!r} of {character} is driven by two parts")
        made.append(Pair(_named(performer, pair.source, "the performer"), Target(0, chain)))
    return mapping_of(made, performer, parts, bound) if made else None


def _named(parts: Parts, words: str, whose: str) -> int:
    try:
        return parts.named(words)
    except InputError as error:
        raise InputError(f"{whose}: {error}") from error
