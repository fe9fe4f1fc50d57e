"""Pairs in words, such as "left arm -> tentacle 3": what drives what, as somebody calls it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from devices.errors import InputError

MOST_LETTERS = 200  # of a pair in words
EXAMPLE = '"left arm -> tentacle 3"'


@dataclass(frozen=True, slots=True)
class WordedPair:
    """A part of the performer and a part of a character, as somebody calls them.

    Attributes:
        source: what drives.
        target: what is driven, after the name of the character and a colon where one is named.
    """

    source: str
    target: str

    def target_of(self, character: str) -> str | None:
        """Return what is driven of a character, by its name; None where another one is named."""
        name, colon, part = self.target.partition(":")
        if not colon:
            return self.target
        return part.strip() if name.strip().casefold() == character.casefold() else None


def read_pair(words: str) -> WordedPair:
    """Read a pair in words.

    Raises:
        InputError: it has not two parts with an arrow between them.
    """
    parts = [part.strip() for part in re.split("->|→", words[:MOST_LETTERS])]
    if len(parts) != 2 or not all(parts):
        raise InputError(f"{words[:MOST_LETTERS]!r} is no pair: expected one such as {EXAMPLE}")
    return WordedPair(*parts)
