"""Acts: each performer with the puppets that follow; and the matching of all acts as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from devices.skeleton import SkeletonFrame
from runtime.driving.match_session import MatchSession, MatchSessionState
from runtime.driving.performer import Performer, PerformerState, Pose
from runtime.driving.unfreeze_blend import UnfreezeBlend, UnfreezeBlendState
from runtime.puppet.puppet import Puppet, PuppetState


@dataclass(frozen=True, slots=True, eq=False)
class ActState:
    """The state of an `Act` between two frames: the states of its parts, and the newest pose."""

    performer: PerformerState
    match_session: MatchSessionState
    unfreeze_blend: UnfreezeBlendState
    puppets: tuple[PuppetState, ...]
    pose: Pose | None


class Act:
    """One performer and the puppets that follow.

    Args:
        performer: who drives.
        puppets: what follows.
        match_session: matches the puppets to the performer.

    Attributes:
        performer, puppets, match_session: as given.
        pose: the performer's newest pose in this show; None before the first frame.
    """

    def __init__(
        self, performer: Performer, puppets: Sequence[Puppet], match_session: MatchSession
    ) -> None:
        self.performer = performer
        self.puppets = puppets
        self.match_session = match_session
        self.pose: Pose | None = None
        self._unfreeze_blend = UnfreezeBlend(performer.skeleton)

    def snapshot(self) -> ActState:
        """Return what is remembered between frames."""
        return ActState(
            self.performer.snapshot(),
            self.match_session.snapshot(),
            self._unfreeze_blend.snapshot(),
            tuple(puppet.snapshot() for puppet in self.puppets),
            self.pose,
        )

    def restore(self, state: ActState) -> None:
        """Go back to a snapshot of an act with the same puppets."""
        self.performer.restore(state.performer)
        self.match_session.restore(state.match_session)
        self._unfreeze_blend.restore(state.unfreeze_blend)
        for puppet, own in zip(self.puppets, state.puppets, strict=True):
            puppet.restore(own)
        self.pose = state.pose

    def receive(self, frame: SkeletonFrame, *, frozen: bool) -> None:
        """Take in the performer's newest frame; match, unless the characters are frozen."""
        self.pose = self.performer.follow(frame)
        if self.performer.calibrates:
            self.match_session.calibrate()
        if not frozen:
            self.match_session.direct(frame)

    def freeze(self, time: float) -> None:
        """Keep the characters frozen at `time` [s]."""
        self._unfreeze_blend.freeze(time)

    def followed_pose(self, time: float) -> Pose | None:
        """Return the pose that the puppets follow at `time` [s], blended after a freeze."""
        if self.pose is None:
            return None
        return self._unfreeze_blend.follow(self.pose, time, self.match_session.rests)


class MatchControls(Protocol):
    """The actions of a puppeteer on the matching; see `MatchSession`."""

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
    """Passes each action on the matching to the match sessions of all acts."""

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
