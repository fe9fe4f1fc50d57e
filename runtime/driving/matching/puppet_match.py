"""One puppet of a match session: the choice of its mapping and rest state, and its driver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devices.errors import InputError
from runtime.driving.by_hand.choosing import has_group, spread_out
from runtime.driving.choices import Candidate, Choices, OwnChoice
from runtime.driving.driver import DrivenPart, Driver, MappedDriver
from runtime.driving.drivers import (
    LIMB_BY_LIMB,
    DriverFactory,
    best_driver,
    driver_of_joints,
    matched_driver,
)
from runtime.driving.mapping import Mapping
from runtime.driving.matching.hand_mapping import mapping_of_hands
from runtime.driving.matching.mapping_choice import MappingChoice
from runtime.driving.matching.match_guard import MatchGuard
from runtime.driving.matching.match_setup import MatchSetup
from runtime.driving.matching.puppet_match_state import PuppetMatchState
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, Pose, Rest
from runtime.driving.polyline_driver import STRAIGHT_ON, PolylineDriver
from runtime.driving.reach import Reach, reach_of
from runtime.driving.turn_limits import tried_out
from runtime.puppet.puppet import Puppet
from solvers.retarget.match_hysteresis import MatchHysteresis
from solvers.retarget.source_limbs import SimplifiedSource

OF_ANATOMY = 1.0  # [s] at most that a performer is seen before the anatomy's choice performs

Array = NDArray[np.float64]


class PuppetMatch:
    """Matches one puppet to a performer, and prepares the puppet's driver.

    A puppet that performs goes on while another match is looked for: what is shown is then the
    driver that is proposed, which moves the puppet once it is accepted.

    Args:
        performer: the performer whose poses are matched.
        source: the performer's chosen joints at rest, simplified.
        puppet: what is driven.
        choices: the settings of the matching.
        by_hand: the mapping to use instead of a match, or None.
        make_driver: makes the puppet's driver.

    Attributes:
        rest: the performer's rest state; None while the puppet is not driven.
        matching: whether a match is looked for.
    """

    def __init__(
        self,
        performer: Performer,
        source: SimplifiedSource,
        puppet: Puppet,
        *,
        choices: Choices,
        by_hand: Mapping | None,
        make_driver: DriverFactory,
    ) -> None:
        self.puppet = puppet
        self.rest: Rest | None = None
        self._performer, self._choices = performer, choices
        self._given = self._own = self._drives = OwnChoice(by_hand=by_hand)
        self._clip: Sequence[Pose] = ()
        self._mapping_choice = MappingChoice(performer, source, puppet, choices, by_hand)
        self._hysteresis = MatchHysteresis(choices.rank - 1)
        self._make_usual = make_driver
        self._of_hands = mapping_of_hands(self._pairing()) if make_driver is best_driver else None
        self.matching, self._view = True, STRAIGHT_ON
        self._driver = self._make(make_driver)
        guarded = make_driver is best_driver and isinstance(self._driver, MappedDriver)
        self._anatomy = MatchGuard(performer, source, puppet) if guarded else None
        self._proposal: Driver | None = None
        puppet.drive_with(self._driver)

    def snapshot(self) -> PuppetMatchState:
        """Return what is remembered between frames."""
        proposal = None if self._proposal is None else self._proposal.snapshot()
        shown, chosen = self._hysteresis.snapshot(), (self._own, self._drives)
        return PuppetMatchState(self.rest, self._view, shown, self.matching, *chosen, proposal)

    def restore(self, state: PuppetMatchState) -> None:
        """Go back to a snapshot; the puppet's own brings the driver back."""
        self.rest, self._view, self.matching = state.rest, state.view, state.matching
        self._hysteresis.restore(state.hysteresis)
        if self._drives is not state.drives:
            self._choose(state.drives)
            self._drive_with(self._make(self._make_driver))
        self._choose(state.own)
        proposal = None if state.proposal is None else self._make(self._make_driver)
        if proposal is not None:
            proposal.restore(state.proposal)
        self._propose(proposal)

    @property
    def mapping(self) -> Mapping:
        """The mapping that is shown, or else drives the puppet; without drives if there is none."""
        return self._shown.mapping if isinstance(self._shown, MappedDriver) else Mapping(())

    @property
    def parts(self) -> Sequence[DrivenPart]:
        """What drives what, in words and numbers; as it is shown while a match is looked for."""
        return self._shown.parts

    @property
    def candidate(self) -> Candidate | None:
        """The match that is shown; None where the anatomy chooses, or no pose was struck."""
        if not isinstance(self._shown, MappedDriver) or not self.mapping.drives or self._of_anatomy:
            return None
        rank, count = (0, 0) if self._own.by_hand is not None else self._hysteresis.place
        return Candidate(rank, count, self.mapping.score)

    @property
    def best(self) -> list[Mapping]:
        """Up to four of the best matches that can be stepped through, while one is shown."""
        if not self.matching or self.candidate is None or self._own.by_hand is not None:
            return []
        return [self._mapping_choice.mapping_of(each) for each in self._hysteresis.best]

    @property
    def patience(self) -> float:
        """[s] that the performer must keep still before what is shown performs by itself."""
        first, again = self._choices.patience, self._choices.again
        own = first if self.rest is None or again is None else again
        short = not isinstance(self._shown, MappedDriver) and math.isfinite(own)
        return min(own, OF_ANATOMY) if short else own

    @property
    def needs_stillness(self) -> bool:
        """Whether the pose chooses what is shown, so that it must be kept still."""
        return isinstance(self._shown, MappedDriver)

    @property
    def needs_clip(self) -> bool:
        """Whether the driver needs the whole clip before the first frame."""
        return self._shown.needs.clip

    @property
    def can_perform(self) -> bool:
        """Whether what is shown has what it needs to start."""
        return not isinstance(self._shown, MappedDriver) or bool(self._shown.mapping.drives)

    @property
    def _shown(self) -> Driver:
        return self._driver if self._proposal is None else self._proposal

    def match(self, positions: Array, time: float, view: Array) -> bool:
        """Show the mapping for a pose; return whether another one was shown before.

        Args:
            positions: (J, 3) [m] the performer's joints.
            time: [s].
            view: (3, 3) rotation from the stage to the camera.

        Raises:
            InputError: there is no match of the rank that was chosen.
        """
        shown = self._shown
        if not isinstance(shown, MappedDriver):
            return False
        before, mapping = shown.mapping.drives, self._of_anatomy
        if mapping is None:
            mapping = self._mapping_choice.of_pose(
                self._hysteresis, positions, time, view, self._guard
            )
        shown.show(mapping, view)
        return mapping.drives != before

    def perform(self, rest: Rest, view: Array) -> None:
        """Let what is shown drive the puppet, from this rest state on.

        Raises:
            InputError: it cannot drive this character, or the driver needs a recording. What drove
                the puppet before goes on.
        """
        shown = self._shown
        if shown.needs.clip and not self._clip:
            raise InputError(
                f"the driver of {self.puppet.character.name} needs the whole motion before its "
                "first frame: replay a recording, or choose a driver that follows a live stream"
            )
        if isinstance(shown, MappedDriver):
            shown.show(shown.mapping, view)
        shown.prepare(self._clip, rest)
        if self.rest is not None or not isinstance(shown, MappedDriver):
            self.puppet.ease()  # a match departs from the rest pose as it is
        if shown is not self._driver:
            self._drive_with(shown)
            self._propose(None)
        self.rest, self.matching, self._view = rest, False, view

    def restate(self, rest: Rest, view: Array) -> None:
        """Go on from another rest state for the same mapping, with the same turn limits.

        A match that is proposed meanwhile stays proposed.
        """
        self._prepare(self._driver, replace(self.setup, rest=rest, view=view))
        self.rest, self._view = rest, view

    @property
    def setup(self) -> MatchSetup:
        """What drives the puppet now, whatever is proposed."""
        driver, own = self._driver, self._drives
        mapping, gains = Mapping(()), np.ones(0)
        if isinstance(driver, MappedDriver) and self.rest is not None:
            mapping, gains = driver.mapping, driver.gains
        by_hand, shares = own.by_hand is not None, tuple(gains.tolist())
        return MatchSetup(self.rest, mapping, self._view, own.stepped, shares, by_hand)

    def set_up(self, setup: MatchSetup) -> None:
        """Drive the puppet as it was driven with an earlier setup; what is proposed is dropped.

        Raises:
            InputError: the setup does not fit the puppet, which goes on as it is driven now.
        """
        before = self._own
        self._choose(OwnChoice(setup.matched, setup.mapping if setup.by_hand else None))
        driver = self._make(self._make_driver)
        try:
            self._prepare(driver, setup)
        except InputError:
            self._choose(before)
            raise
        self._propose(None)
        self._drive_with(driver)
        self.rest, self.matching, self._view = setup.rest, setup.rest is None, setup.view

    def choose(self, mapping: Mapping, view: Array) -> None:
        """Follow a mapping that the user made, whatever anatomy and matches say.

        A puppet that performs goes on by it at once, from the same rest state, and departs from
        what is shown now. Else the mapping waits to be accepted, as a match does.

        Raises:
            InputError: the puppet cannot be driven so; nothing changes then.
        """
        self.set_up(MatchSetup(self.rest, mapping, view, matched=False, gains=(), by_hand=True))

    def delay(self, phase: float) -> None:
        """Let chains with one source follow one `phase` [s] after the other, in their order."""
        driver = self._driver
        if isinstance(driver, PolylineDriver) and has_group(driver.mapping):
            driver.delay(spread_out(driver.mapping, phase))
            if self._own is self._drives and self._own.by_hand is not None:
                self._choose(OwnChoice(by_hand=driver.mapping))
                self._drives = self._own

    def rehearse(self, clip: Sequence[Pose], states: Sequence[Rest], view: Array) -> None:
        """Let the puppet perform from that one of these rest states which is most like it.

        A driver without a mapping performs from the first.

        Args:
            clip: poses of the recording that will be played: see `Driver.prepare`.
            states: at least one.
            view: (3, 3) rotation from the stage to the camera.
        """
        self._clip, rest = clip, states[0]
        if isinstance(self._driver, MappedDriver):
            mapping, rest, self._hysteresis = self._mapping_choice.best_of(
                states, view, self._of_anatomy, self._guard
            )
            self._driver.show(mapping, view)
        self.perform(rest, view)

    def try_out(self, tried: Sequence[Pose], poses: Sequence[Pose]) -> Reach:
        """Limit the turns to what the surface can follow, if a mapping drives.

        Args:
            tried: at least one pose that the surface tries.
            poses: poses of the whole way, which are placed only.
        """
        around = tried_out(self.puppet, self._driver, tried)
        return reach_of(self._driver, self.puppet.root, around, poses)

    def match_again(self, view: Array) -> None:
        """Look for a match by the pose alone, or by the anatomy, whatever was chosen by hand.

        A puppet that performs goes on until what is shown is accepted.
        """
        self._hysteresis.release()
        self._choose(self._given)
        self._look_again(view)

    def step(self, ranks: int, view: Array) -> None:
        """Show the match so many ranks after the one shown, and stay there.

        Where the anatomy had chosen, the first step shows the best match: the user's choice beats
        both. A puppet that performs goes on until what is shown is accepted.
        """
        if self._own.by_hand is not self._given.by_hand:
            self._choose(self._given)
        if self._make_driver is best_driver and (self._of_anatomy or not self.mapping.drives):
            self._choose(replace(self._own, stepped=True))
            self._look_again(view)
            return
        self._hysteresis.cycle(ranks)
        if not self.matching:
            self._look_again(view)

    def take(self, rank: int, view: Array) -> None:
        """Show one of the `best` matches, 1 for the first, and stay there, as `step` does."""
        self.step(0, view)
        self._hysteresis.choose(rank - 1)

    def keep(self) -> None:
        """Stop looking for a match; the puppet goes on as it performs."""
        if self.rest is not None:
            self.matching = False
            self._choose(self._drives)
            self._propose(None)

    def _look_again(self, view: Array) -> None:
        """Look for a match with a new driver, which shows what is shown now, if anything is."""
        shown, mapping = self._make(self._make_driver), self.mapping
        if isinstance(shown, MappedDriver) and mapping.drives and mapping is not self._of_hands:
            shown.show(mapping, view)
        self.matching = True
        if self.rest is None:
            self._drive_with(shown)
        else:
            self._propose(shown)

    @property
    def _make_driver(self) -> DriverFactory:
        chosen = self._own.by_hand is not None and self._make_usual in LIMB_BY_LIMB
        return matched_driver if self._own.stepped or chosen else self._make_usual

    def _choose(self, own: OwnChoice) -> None:
        """Let the next driver come of a choice of the user."""
        self._own, self._mapping_choice.by_hand = own, own.by_hand

    def _drive_with(self, driver: Driver) -> None:
        """Let a driver that `_make_driver` made move the puppet."""
        self._driver, self._drives = driver, self._own
        self.puppet.drive_with(driver)

    def _propose(self, driver: Driver | None) -> None:
        self._proposal = self.puppet.proposal = driver

    def switch(self, make_driver: DriverFactory, view: Array) -> None:
        """Let another driver move the puppet from the next pose on, from the same rest state.

        A driver that takes a mapping gets the same mapping and the same turn limits; where there
        is no mapping yet, the best match for the rest state. What is proposed is dropped.

        Raises:
            InputError: the new driver cannot drive this puppet; the old one goes on.
        """
        driver = self._make(make_driver)
        self.keep()
        mapping = self.mapping
        if isinstance(driver, MappedDriver) and self.rest is not None and not mapping.drives:
            mapping = self._mapping_choice.of_pose(self._hysteresis, self.rest.positions, 0.0, view)
        self._prepare(driver, replace(self.setup, mapping=mapping, view=view))
        self._make_usual, self._view = make_driver, view
        self._choose(replace(self._own, stepped=False))
        self._drive_with(driver)

    def _prepare(self, driver: Driver, setup: MatchSetup) -> None:
        """Make a driver ready to move the puppet, which will ease over to it."""
        if isinstance(driver, MappedDriver):
            driver.show(setup.mapping, setup.view)
        driver.prepare(self._clip, setup.rest)
        if isinstance(driver, MappedDriver) and setup.gains:
            driver.gains = np.array(setup.gains)
        self.puppet.ease()

    @property
    def _of_anatomy(self) -> Mapping | None:
        """What hands drive, where neither the user chose a mapping nor stepped to a match."""
        chosen = self._own.by_hand is not None or self._make_driver is not best_driver
        return None if chosen else self._of_hands

    @property
    def _guard(self) -> MatchGuard | None:
        """What ranks the matches by anatomy too, where the driver that suits was asked for."""
        return self._anatomy if self._make_usual is best_driver else None

    def _pairing(self) -> Pairing:
        puppet, performer = self.puppet, self._performer
        joints, own = tuple(performer.joints), self._own
        moved = puppet.character, puppet.bound_skeleton, puppet.surface
        return Pairing(performer.skeleton, joints, *moved, own.by_hand)

    def _make(self, make_driver: DriverFactory) -> Driver:
        return driver_of_joints(make_driver, self._pairing())
