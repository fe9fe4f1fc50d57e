"""Several performers with characters of their own, directed as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer
from runtime.puppet.puppet import Puppet


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
    match_session: MatchSession


class Cues(Protocol):
    """What a puppeteer may ask of the show; see `MatchSession`."""

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


class ActGroup:
    """Gives each cue to the directors of all acts."""

    def __init__(self, match_sessions: Sequence[MatchSession]) -> None:
        self._match_sessions = match_sessions

    @property
    def matching(self) -> bool:
        """Whether a match is still looked for in any act."""
        return any(match_session.matching for match_session in self._match_sessions)

    def accept(self) -> None:
        """See `MatchSession.accept`; acts that perform already go on."""
        for match_session in self._match_sessions:
            if match_session.matching:
                match_session.accept()

    def take_rest(self) -> None:
        """See `MatchSession.take_rest`."""
        for match_session in self._match_sessions:
            match_session.take_rest()

    def calibrate(self) -> None:
        """See `MatchSession.calibrate`."""
        for match_session in self._match_sessions:
            match_session.calibrate()

    def match_again(self) -> None:
        """See `MatchSession.match_again`."""
        for match_session in self._match_sessions:
            match_session.match_again()

    def next_match(self) -> None:
        """See `MatchSession.next_match`."""
        for match_session in self._match_sessions:
            match_session.next_match()

    def previous_match(self) -> None:
        """See `MatchSession.previous_match`."""
        for match_session in self._match_sessions:
            match_session.previous_match()
