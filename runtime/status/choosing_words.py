"""What a show says during mapping by hand: which pairs there are, and what to click next."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ChoosingStatus:
    """The progress of mapping by hand.

    Attributes:
        performer: whether the performer is a recording, so that "you" is somebody else.
        character: the name of the character that is chosen for.
        source: the performer's part that waits for one of a character, in words; "" for none.
        target: the part of a character that waits for one of the performer, likewise.
        pairs: how many pairs there are.
        changed: whether they are others than those that drive.
        wider: whether another view shows much more of the character.
    """

    character: str
    recorded: bool = False
    source: str = ""
    target: str = ""
    pairs: int = 0
    changed: bool = False
    wider: bool = False


def choosing_headline(status: ChoosingStatus) -> str:
    """What is going on, to be read from two metres away."""
    if status.source:
        return f"What moves with {_article(status.source)}?"
    if status.target:
        return f"What moves {_article(status.target)}?"
    return "Mapping by hand"


def choosing_advice(status: ChoosingStatus) -> str:
    """What to do next, in one or two sentences."""
    whose, owner = ("your", "yourself") if not status.recorded else ("the", "the performer")
    if status.source:
        part = status.source if status.recorded else f"{whose} {status.source}"
        part = f"the {part}" if status.recorded else part
        return f"Click the part of {status.character} that {part} moves."
    if status.target:
        return (
            f"Click the part of {owner}, in the small picture, that moves "
            f"{_article(status.target)} of {status.character}."
        )
    first = f"Click a part of {owner} in the small picture, or a part of {status.character}."
    if status.changed:
        many = "this pair" if status.pairs == 1 else f"these {status.pairs} pairs"
        first += f" Enter uses {many if status.pairs else 'the best match again'}."
    elif status.wider:
        first += " F7 turns to where more of it is seen."
    return f"{first} Escape leaves all as it was."


def _article(part: str) -> str:
    """A part in words, with "the" where it is no name with a number."""
    name = part.partition(",")[0]
    return name if any(letter.isdigit() for letter in name) else f"the {name}"
