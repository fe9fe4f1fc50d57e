"""Setups in a running show: written to the session when they change, and restored by undo."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.driving.mapping import Drive, Mapping, check_drive
from runtime.driving.matching.match_setup import MatchSetup
from runtime.driving.matching.puppet_match import PuppetMatch
from runtime.driving.performer import Performer, Rest
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from runtime.session.document import Session
from runtime.session.edits import set_up
from runtime.session.files.store import SessionStore
from runtime.session.setup import RIGID, Pair, Point, Setup, StruckMatch

ONE_STEP = 1.0  # [s] between changes of a slider that are undone as one


@dataclass(frozen=True, slots=True, eq=False)
class SetupInShow:
    """A setup as the show has it."""

    match: MatchSetup
    elasticity: Elasticity
    in_place: bool


class ActorSetup:
    """The setup of one actor: in the show, and as a value of the document.

    Args:
        actor: its id in the session.
        performer: who drives it.
        puppet: on the stage.
        match: of the puppet with the performer.
    """

    def __init__(
        self, actor: int, performer: Performer, puppet: Puppet, match: PuppetMatch
    ) -> None:
        self.actor, self.puppet = actor, puppet
        self._performer, self._match = performer, match
        self._seen = self.seen

    @property
    def seen(self) -> SetupInShow:
        """The setup as it is now."""
        puppet = self.puppet
        return SetupInShow(self._match.setup, puppet.surface.elasticity, puppet.travel.in_place)

    def changed(self, setup: Setup) -> tuple[Setup, str] | None:
        """Return the document's setup with what has changed in the show since the last call.

        Returns:
            The setup and what was done, in words; None where nothing has changed.
        """
        before, now = self._seen, self.seen
        self._seen = now
        name, done = self.puppet.character.name, ""
        if not now.match.is_as(before.match):
            setup, done = replace(setup, match=self._struck(now.match)), f"match {name}"
        if now.elasticity != before.elasticity:
            setup = replace(setup, elasticity=now.elasticity)
            done = done or f"change the surface of {name}"
        if now.in_place is not before.in_place:
            setup = replace(setup, in_place=now.in_place)
            done = done or (f"keep {name} in place" if now.in_place else f"let {name} travel")
        return (setup, done) if done else None

    def as_it_is(self) -> Setup:
        """Return the whole setup of the show."""
        now = self._seen = self.seen
        return Setup(self._struck(now.match), now.elasticity, now.in_place)

    def take_up_surface(self, setup: Setup) -> None:
        """Give the puppet the surface and the way over the stage that the document says."""
        puppet = self.puppet
        if puppet.surface.elasticity != setup.elasticity:
            puppet.surface.elasticity = setup.elasticity
            puppet.ease()
        puppet.travel.in_place = setup.in_place
        self._seen = self.seen

    def take_up_match(self, setup: Setup) -> None:
        """Let the puppet be driven as the document says.

        Raises:
            InputError: the match was struck by a performer with other joints, or does not fit the
                character, which is driven as before.
        """
        if self._struck(self._match.setup) != setup.match:
            self._match.set_up(self._unstruck(setup.match))
        self._seen = self.seen

    def _struck(self, match: MatchSetup) -> StruckMatch | None:
        """A match as a value of the document."""
        rest, names = match.rest, self._performer.skeleton.names
        if rest is None:
            return None
        gains = match.gains or (1.0,) * len(match.mapping.drives)
        return StruckMatch(
            joints=names,
            rest=_points(rest.positions),
            heading=rest.heading,
            height=rest.height,
            mirrored=self._performer.mirrors,
            view=_points(match.view),  # type: ignore[arg-type]  # three rows
            pairs=tuple(
                Pair(
                    tuple(names[joint] for joint in drive.source),
                    drive.target,
                    drive.flip,
                    gain,
                    drive.delay,
                )
                for drive, gain in zip(match.mapping.drives, gains, strict=True)
            ),
            matched=match.matched,
            by_hand=match.by_hand,
        )

    def _unstruck(self, match: StruckMatch | None) -> MatchSetup:
        """A match of the document as the show has it."""
        if match is None:
            return MatchSetup(None, Mapping(()), np.eye(3), matched=False, gains=())
        performer, skeleton = self._performer.skeleton, self.puppet.character.skeleton
        if set(match.joints) != set(performer.names):
            raise InputError(
                f"{self.puppet.character.name} was matched with a performer of other joints: "
                "strike a pose and press m to match it again"
            )
        places = dict(zip(match.joints, match.rest, strict=True))
        rest = Rest(
            np.array([places[name] for name in performer.names]), match.heading, match.height
        )
        if match.mirrored is not self._performer.mirrors:
            rest = self._performer.restated(rest, mirror=True, scale=1.0)
        drives = tuple(_drive(pair, performer, skeleton) for pair in match.pairs)
        gains = tuple(pair.gain for pair in match.pairs)
        return MatchSetup(
            rest, Mapping(drives), np.array(match.view), match.matched, gains, match.by_hand
        )


class LiveSetups:
    """Keeps the setups of a session's actors as the show has them, a step for each change.

    Args:
        store: where the session is kept.
        actors: the setup of each actor.
        clock: host monotonic time [s].
        warn: takes one line on a fault.
    """

    def __init__(
        self,
        store: SessionStore,
        actors: Sequence[ActorSetup],
        *,
        clock: Callable[[], float],
        warn: Callable[[str], None],
    ) -> None:
        self._store, self._actors = store, actors
        self._clock, self._warn = clock, warn
        self._changed_at: float | None = None

    def begin(self) -> Session:
        """Set the show up as the session says; return the session with the setups it has not.

        What the show has been asked for by options goes before what the session says.
        """
        session = self._store.session
        for own in self._actors:
            setup = session.actor(own.actor).setup
            if setup is None:
                session = set_up(session, own.actor, own.as_it_is())
                continue
            own.take_up_surface(_asked_before(own.seen, setup))
            if setup.match is not None:
                self._take_up_match(own, setup)
        return session

    def note(self) -> bool:
        """Note what has changed in the show, as a step of the session.

        Changes of one kind that follow one another within a second are one step.

        Returns:
            Whether a step has come to its end, and is to be written to the disk.
        """
        session, steps = self._store.session, []
        for own in self._actors:
            setup = session.actor(own.actor).setup
            changed = own.changed(Setup() if setup is None else setup)
            if changed is not None:
                session = set_up(session, own.actor, changed[0])
                steps.append(changed[1])
        if steps:
            self._changed_at = self._clock()
            self._store.versions.drag(session, ", ".join(steps))
            return False
        if self._changed_at is None or self._clock() - self._changed_at < ONE_STEP:
            return False
        self._changed_at = None
        self._store.versions.drop()
        return True

    def bring_back(self) -> None:
        """Set the show up as the session says now, as after an undo."""
        for own in self._actors:
            setup = self._store.session.actor(own.actor).setup
            if setup is not None:
                own.take_up_surface(setup)
                self._take_up_match(own, setup)

    def _take_up_match(self, own: ActorSetup, setup: Setup) -> None:
        try:
            own.take_up_match(setup)
        except InputError as error:
            self._warn(str(error))


def _asked_before(now: SetupInShow, setup: Setup) -> Setup:
    """The setup with what the show was asked for by options in place of what it says itself."""
    asked = now.elasticity != RIGID
    elasticity = now.elasticity if asked else setup.elasticity
    return replace(setup, elasticity=elasticity, in_place=now.in_place or setup.in_place)


def _drive(pair: Pair, performer: Skeleton, character: Skeleton) -> Drive:
    """A pair of the document as a drive.

    Raises:
        InputError: a joint or a node is not there.
    """
    if not all(0 <= node < len(character.names) for node in pair.target):
        raise InputError(f"a match drives nodes that are not there: {pair.target}")
    source = tuple(performer.index(name) for name in pair.source)
    drive = Drive(source, pair.target, pair.flip, pair.delay)
    check_drive(drive, character)
    return drive


def _points(rows: NDArray[np.float64]) -> tuple[Point, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in rows)
