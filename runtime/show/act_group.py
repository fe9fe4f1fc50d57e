"""All acts of a show: each performer with the puppets that follow, matched together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from devices.skeleton import SkeletonFrame
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession, MatchSessionState
from runtime.driving.matching.puppet_match import PuppetMatch
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

    def match_again_at(self, frame: SkeletonFrame) -> None:
        """Look for matches once more by the last pose, at its frame."""
        if self.pose is not None:
            self.match_session.direct(frame)

    def freeze(self, time: float) -> None:
        """Keep the characters frozen at `time` [s]."""
        self._unfreeze_blend.freeze(time)

    def followed_pose(self, time: float) -> Pose | None:
        """Return the pose that the puppets follow at `time` [s], blended after a freeze."""
        if self.pose is None:
            return None
        return self._unfreeze_blend.follow(self.pose, time, self.match_session.rests)


class ActGroup:
    """Passes each action on the matching to the acts of the characters that are selected.

    Args:
        acts: each performer with their puppets, from left to right on the stage.
    """

    def __init__(self, acts: Sequence[Act]) -> None:
        self._acts = acts
        self._selected: int | None = None

    @property
    def selected(self) -> int | None:
        """The number of the character that actions are for, from 0; None for all."""
        return self._selected

    def select(self, number: int | None) -> None:
        """Select one character for the actions that follow, or all; ignore a number too high."""
        if number is not None and number >= sum(len(act.puppets) for act in self._acts):
            return
        self._selected, first = number, 0
        for act in self._acts:
            count = len(act.puppets)
            own = None if number is None or not 0 <= number - first < count else number - first
            act.match_session.selected = own
            first += count

    @property
    def puppets(self) -> list[Puppet]:
        """The puppets that actions are for."""
        every = [puppet for act in self._acts for puppet in act.puppets]
        return every if self._selected is None else [every[self._selected]]

    @property
    def matches(self) -> list[PuppetMatch]:
        """The match of each character, whichever is selected."""
        return [match for act in self._acts for match in act.match_session.matches]

    def performer_of(self, number: int) -> Performer:
        """Return who drives a character, by its number."""
        return [act.performer for act in self._acts for _ in act.puppets][number]

    def choose(self, number: int, mapping: Mapping | None) -> None:
        """Let a character, by its number, follow a mapping made by hand; None to match it again.

        Raises:
            InputError: the character cannot be driven so; nothing changes then.
        """
        for act in self._acts:
            if number < len(act.puppets):
                act.match_session.choose(number, mapping)
                return
            number -= len(act.puppets)

    def wait(self, on: bool) -> None:
        """While `on`, let no match start to perform by itself."""
        for act in self._acts:
            act.match_session.waits = on

    @property
    def matching(self) -> bool:
        """Whether a match is still looked for in any act."""
        return any(act.match_session.matching for act in self._acts)

    def accept(self) -> None:
        """See `MatchSession.accept`."""
        for match_session in self._sessions:
            match_session.accept()

    def keep(self) -> None:
        """See `MatchSession.keep`."""
        for match_session in self._sessions:
            match_session.keep()

    def take_rest(self) -> None:
        """See `MatchSession.take_rest`."""
        for match_session in self._sessions:
            match_session.take_rest()

    def calibrate(self) -> None:
        """See `MatchSession.calibrate`."""
        for match_session in self._sessions:
            match_session.calibrate()

    def match_again(self) -> None:
        """See `MatchSession.match_again`."""
        for match_session in self._sessions:
            match_session.match_again()

    def next_match(self) -> None:
        """See `MatchSession.next_match`."""
        for match_session in self._sessions:
            match_session.next_match()

    def previous_match(self) -> None:
        """See `MatchSession.previous_match`."""
        for match_session in self._sessions:
            match_session.previous_match()

    def show_match(self, rank: int) -> None:
        """See `MatchSession.show_match`."""
        for match_session in self._sessions:
            match_session.show_match(rank)

    @property
    def _sessions(self) -> list[MatchSession]:
        """Those of the characters that are selected."""
        return [
            act.match_session
            for act in self._acts
            if self._selected is None or act.match_session.selected is not None
        ]
