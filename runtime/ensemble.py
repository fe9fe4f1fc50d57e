"""Several performers with characters of their own, directed as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from runtime.director import Director
from runtime.performer import Performer
from runtime.puppet import Puppet


@dataclass(frozen=True, slots=True, eq=False)
class Act:
    """What one performer does in the show.

    Attributes:
        performer: who drives.
        puppets: who follow.
        director: who decides what drives what.
    """

    performer: Performer
    puppets: Sequence[Puppet]
    director: Director


class Cues(Protocol):
    """What a puppeteer may ask of the show; see `Director`."""

    @property
    def matching(self) -> bool:
        """Whether a match is still looked for."""
        ...

    def accept(self) -> None:
        """Let the matches shown perform; the pose just struck is the rest state."""
        ...

    def take_rest(self) -> None:
        """Take the pose just struck as the rest state."""
        ...

    def calibrate(self) -> None:
        """Take the pose just struck as the rest state, and measure floor and sizes anew."""
        ...

    def match_again(self) -> None:
        """Return to matching."""
        ...

    def next_match(self) -> None:
        """Show the match after the one shown."""
        ...

    def previous_match(self) -> None:
        """Show the match before the one shown."""
        ...


class Ensemble:
    """Gives each cue to the directors of all acts."""

    def __init__(self, directors: Sequence[Director]) -> None:
        self._directors = directors

    @property
    def matching(self) -> bool:
        """Whether a match is still looked for in any act."""
        return any(director.matching for director in self._directors)

    def accept(self) -> None:
        """See `Director.accept`; acts that perform already go on."""
        for director in self._directors:
            if director.matching:
                director.accept()

    def take_rest(self) -> None:
        """See `Director.take_rest`."""
        for director in self._directors:
            director.take_rest()

    def calibrate(self) -> None:
        """See `Director.calibrate`."""
        for director in self._directors:
            director.calibrate()

    def match_again(self) -> None:
        """See `Director.match_again`."""
        for director in self._directors:
            director.match_again()

    def next_match(self) -> None:
        """See `Director.next_match`."""
        for director in self._directors:
            director.next_match()

    def previous_match(self) -> None:
        """See `Director.previous_match`."""
        for director in self._directors:
            director.previous_match()
