"""The state of a show for people: what is seen, what drives what, what is recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from replay.playback import Playback
from runtime.control.count_in import Counted, CountIn
from runtime.driving.choices import Candidate
from runtime.driving.driver import DrivenPart
from runtime.driving.performer import Pose
from runtime.session.live_session import LiveSession
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from runtime.show.takes import RunningTake, Takes
from runtime.status.choosing_words import ChoosingStatus
from runtime.status.session_words import SessionStatus, session_status
from runtime.status.stream_watch import Sighting, StreamWatch


@dataclass(frozen=True, slots=True)
class CharacterStatus:
    """What one character does.

    Attributes:
        name: of the character.
        parts: what drives what; as it is shown while a match is looked for.
        performing: whether a performer drives it.
        matching: whether a match is looked for.
        candidate: the match that is shown; None where the anatomy chooses.
        countdown: [s] until what is shown performs by itself; infinite if it waits to be accepted,
            None while no pose is struck.
        counts: whether the performer keeps still, so that this goes by.
    """

    name: str
    parts: Sequence[DrivenPart]
    performing: bool
    matching: bool
    candidate: Candidate | None
    countdown: float | None
    counts: bool


@dataclass(frozen=True, slots=True)
class PerformerStatus:
    """What is seen of one performer now.

    Attributes:
        seen: joints that are seen.
        joints: joints that there are.
        lost: the parts that drive a character, in words, of which most is not seen.
    """

    seen: int
    joints: int
    lost: Sequence[str]


@dataclass(frozen=True, slots=True)
class PlaybackStatus:
    """Where a recording is.

    Attributes:
        position, duration: [s].
        paused: whether it stands still.
    """

    position: float
    duration: float
    paused: bool


@dataclass(frozen=True, slots=True)
class ShowStatus:
    """The state of a show at one moment.

    Attributes:
        origin: the address or name of the stream.
        sighting: what is seen of the performer.
        characters: from left to right.
        recording: the files that are being recorded.
        playback: of a recording; None where the performer is live.
        frozen: whether the characters are frozen.
        frames: performed so far.
        session: of the session that is open; None for none.
        performers: who is in view, or was.
        choosing: how far choosing by hand is; None while nothing is chosen.
        count_in: what is counted down for, and the seconds left; None while nothing is.
        hands_free: what gesture does which step, in words, and how much of it is done, in [0, 1];
            None where no gesture does anything.
    """

    origin: str
    sighting: Sighting
    characters: Sequence[CharacterStatus]
    recording: Sequence[RunningTake]
    playback: PlaybackStatus | None
    frozen: bool
    frames: int
    session: SessionStatus | None = None
    performers: Sequence[PerformerStatus] = ()
    choosing: ChoosingStatus | None = None
    count_in: tuple[Counted, float] | None = None
    hands_free: tuple[str, float] | None = None

    @property
    def matching(self) -> bool:
        """Whether a match is looked for, for any character."""
        return any(character.matching for character in self.characters)


class Choosing(Protocol):
    """Pairs that are chosen by hand."""

    @property
    def status(self) -> ChoosingStatus | None:
        """The progress of mapping by hand; None while it is off."""
        ...

    def chosen(self, number: int) -> Sequence[DrivenPart]:
        """Return the pairs of a character in words."""
        ...


class Gestured(Protocol):
    """Does the next step when a performer makes a gesture."""

    @property
    def wanted(self) -> str:
        """What to do for which step, in words; empty where nothing can be asked for now."""
        ...

    @property
    def progress(self) -> float:
        """How much of a gesture is done, in [0, 1]."""
        ...


def status_of(
    origin: str,
    watch: StreamWatch,
    acts: Sequence[Act],
    loop: FrameLoop,
    takes: Takes,
    playback: Playback | None,
    session: LiveSession | None,
    chooser: Choosing,
    count_in: CountIn,
    hands_free: Gestured | None,
) -> ShowStatus:
    """Return the state of a show as it is now, out of its parts."""
    characters = [status for act in acts for status in _characters(act)]
    if (choosing := chooser.status) is not None:
        characters = [
            replace(character, parts=chooser.chosen(number))
            for number, character in enumerate(characters)
        ]
    return ShowStatus(
        origin=origin,
        sighting=watch.look(),
        characters=characters,
        recording=takes.running,
        playback=None
        if playback is None
        else PlaybackStatus(playback.position, playback.duration, playback.paused),
        frozen=loop.frozen,
        frames=loop.frames,
        session=None if session is None else session_status(session),
        performers=[_performer(act, act.pose) for act in acts if act.pose is not None],
        choosing=choosing,
        count_in=None if (counted := count_in.counted) is None else (counted, count_in.left or 0.0),
        hands_free=None if hands_free is None else (hands_free.wanted, hands_free.progress),
    )


def _performer(act: Act, pose: Pose) -> PerformerStatus:
    parts = [part for match in act.match_session.matches for part in match.parts]
    lost = [part.name for part in parts if pose.filled[list(part.source)].mean() > 0.5]
    count = len(pose.filled)
    return PerformerStatus(count - int(pose.filled.sum()), count, list(dict.fromkeys(lost)))


def _characters(act: Act) -> list[CharacterStatus]:
    session = act.match_session
    return [
        CharacterStatus(
            name=puppet.character.name,
            parts=match.parts,
            performing=match.rest is not None,
            matching=match.matching,
            candidate=match.candidate,
            countdown=session.countdown if match.matching else None,
            counts=session.counts and match.matching,
        )
        for puppet, match in zip(act.puppets, session.matches, strict=True)
    ]
