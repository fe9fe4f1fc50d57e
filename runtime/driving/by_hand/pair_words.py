"""Pairs in words, such as "left arm -> tentacle 3": what drives what, as somebody calls it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
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

    @property
    def character(self) -> str | None:
        """The name of the character that is driven; None where none is named."""
        name, colon, _ = self.target.partition(":")
        return name.strip() if colon else None

    def target_of(self, character: str) -> str | None:
        """Return what is driven of a character, by its name; None where another one is named."""
        if self.character is None:
            return self.target
        part = self.target.partition(":")[2].strip()
        return part if self.character.casefold() == character.casefold() else None


def check_named(pairs: Iterable[WordedPair], characters: Sequence[str]) -> None:
    """Refuse pairs that name a character which is not there.

    Args:
        pairs: of all characters.
        characters: their names.

    Raises:
        InputError: one does; the line says which characters there are.
    """
    known = {name.casefold() for name in characters}
    for pair in pairs:
        if pair.character is not None and pair.character.casefold() not in known:
            raise InputError(
                f'"{pair.source} -> {pair.target}": no character is called {pair.character!r}; '
                f"there are: {', '.join(characters)}"
            )


def read_pair(words: str) -> WordedPair:
    """Read a pair in words.

    Raises:
        InputError: it has not two parts with an arrow between them.
    """
    parts = [part.strip() for part in re.split("->|→", words[:MOST_LETTERS])]
    if len(parts) != 2 or not all(parts):
        raise InputError(f"{words[:MOST_LETTERS]!r} is no pair: expected one such as {EXAMPLE}")
    return WordedPair(*parts)
