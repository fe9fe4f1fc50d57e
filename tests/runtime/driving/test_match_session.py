"""Who drives what: matching, accepting, stepping through matches, and looking for a rest state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from devices.bodies.plan_by_names import plan_by_names
from devices.errors import InputError
from runtime.driving.choices import Choices
from runtime.driving.drivers import DRIVERS
from runtime.driving.mapping import Drive, Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer, Pose
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    T_POSE,
    frame,
    make_figure,
    pose,
    seen,
    waving,
)

FIGURE = make_figure()
UPSIDE_DOWN = {"SpineBase": (0.0, 0.0, math.pi)}


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(FIGURE)


class Rehearsal:
    """A performer, a puppet at rest and a match session, fed with poses at a tenth of a second."""

    def __init__(
        self,
        puppet: Puppet,
        choices: Choices,
        by_hand: Mapping | None = None,
        source: str = "whole",
    ) -> None:
        puppet.rest()
        self.puppet = puppet
        self.performer = Performer(BODY, source)
        self.match_session = MatchSession(
            self.performer, [puppet], lambda: FRONT_VIEW, choices, [by_hand]
        )
        self.time = 0.0

    def strike(self, positions: np.ndarray) -> tuple[Drive, ...]:
        captured = frame(positions, self.time)
        self.performer.follow(captured)
        self.match_session.direct(captured)
        self.time += 0.1
        return self.drives

    @property
    def drives(self) -> tuple[Drive, ...]:
        return self.match_session.mappings[0].drives

    def rehearse(self, poses: list[Pose]) -> np.ndarray:
        return self.match_session.rehearse(poses, poses)

    def moves(self, positions: np.ndarray) -> float:
        """How far the puppet goes from rest when the performer does this [m]."""
        self.puppet.follow(self.performer.follow(frame(positions, self.time)))
        return float(np.abs(self.puppet.deform().vertices - FIGURE.vertices).max())


def test_without_patience_the_first_pose_performs_at_once(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices())
    assert show.match_session.matching
    drives = show.strike(pose(T_POSE))
    assert not show.match_session.matching
    assert len(drives) >= 4
    assert show.moves(pose(T_POSE)) < 1e-9, "the pose struck is the rest state"
    assert show.moves(pose()) > 0.2


def test_with_endless_patience_the_choice_of_the_anatomy_waits_too() -> None:
    body = Puppet(replace(FIGURE, plan=plan_by_names(FIGURE.skeleton)))
    performer = Performer(BODY, "whole")
    auto = DRIVERS["auto"]
    for patience, waits in ((math.inf, True), (3.0, False)):
        choices = Choices(patience=patience)
        session = MatchSession(
            performer, [body], lambda: FRONT_VIEW, choices, [None], make_driver=auto
        )
        for step in range(20):
            captured = frame(pose(T_POSE), 0.1 * step)
            performer.follow(captured)
            session.direct(captured)
        assert session.matches[0].candidate is None, "no match was searched"
        assert session.matching is waits


def test_with_endless_patience_it_waits_to_be_accepted(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=math.inf))
    show.match_session.accept()
    assert show.match_session.matching, "there is nothing to accept yet"
    for _ in range(50):
        assert show.strike(pose(T_POSE))
    assert show.match_session.matching
    assert show.moves(pose()) < 1e-9, "shown, and not driven"
    show.strike(pose(T_POSE))
    show.match_session.accept()
    assert not show.match_session.matching
    assert show.moves(pose()) > 0.2


def test_a_match_performs_when_it_has_stood_for_as_long_as_asked(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=0.45))
    waited = 0
    while show.match_session.matching:
        show.strike(pose(T_POSE))
        waited += 1
    assert waited == 6  # at 0.0, 0.1 ... 0.5
    show = Rehearsal(puppet, Choices(patience=1.35))
    for positions in (pose(T_POSE), pose(UPSIDE_DOWN)):
        first = show.drives
        for _ in range(8):  # another match is shown after half a second
            show.strike(positions)
    assert show.drives != first
    assert show.match_session.matching, "the waiting begins anew with another match"


def test_who_comes_back_into_view_has_to_stand_anew(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=0.45))
    show.strike(pose(T_POSE))
    for _ in range(10):
        show.strike(np.full_like(pose(T_POSE), np.nan))
    show.strike(pose(T_POSE))
    assert show.match_session.matching


def test_too_little_of_the_performer_strikes_no_pose(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(), source="arms")
    joints = show.performer.joints
    hidden = pose(T_POSE)
    hidden[joints[: len(joints) // 2 + 1]] = np.nan
    for _ in range(5):
        assert show.strike(hidden) == ()
    assert show.match_session.matching
    hidden = pose(T_POSE)
    hidden[[joint for joint in range(len(BODY.names)) if joint not in joints]] = np.nan
    assert show.strike(hidden) != (), "only what drives must be seen"
    assert not show.match_session.matching


def test_a_rank_shows_that_match_and_one_beyond_the_list_is_told(puppet: Puppet) -> None:
    endless = Choices(patience=math.inf)
    show = Rehearsal(puppet, endless)
    ranked = [show.strike(pose(T_POSE))]
    for _ in range(3):
        show.match_session.next_match()
        ranked.append(show.strike(pose(T_POSE)))
    assert len(set(ranked)) == 4
    for rank in (1, 2, 4):
        other = Rehearsal(puppet, Choices(rank=rank, patience=math.inf))
        assert other.strike(pose(T_POSE)) == ranked[rank - 1]
    beyond = Rehearsal(puppet, Choices(rank=100_000))
    with pytest.raises(InputError, match=r"figure has \d+ matches .* no --match 100000$") as told:
        beyond.strike(pose(T_POSE))
    assert "\n" not in str(told.value)


def test_matches_are_stepped_through_and_stay(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=math.inf))
    best = show.strike(pose(T_POSE))
    show.match_session.next_match()
    second = show.strike(pose(T_POSE))
    assert second != best
    for _ in range(12):
        assert show.strike(pose(T_POSE)) == second
    show.match_session.previous_match()
    assert show.strike(pose(T_POSE)) == best
    show.match_session.previous_match()
    assert show.strike(pose(T_POSE)) not in (best, second)


def test_one_of_the_best_matches_is_taken_and_stays(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=math.inf))
    best = show.strike(pose(T_POSE))
    (match,) = show.match_session.matches
    offered = [mapping.drives for mapping in match.best]
    assert len(offered) == 4
    assert offered[0] == best
    show.match_session.show_match(3)
    for _ in range(12):
        assert show.strike(pose(T_POSE)) == offered[2]
    assert [mapping.drives for mapping in match.best] == offered
    show.match_session.accept()
    assert match.best == []
    show.match_session.show_match(2)
    assert show.match_session.matching, "asked for in the midst of a performance"
    assert show.strike(pose(T_POSE)) == offered[1]


def test_matching_again_looks_at_the_pose_alone(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=math.inf))
    best = show.strike(pose(T_POSE))
    show.match_session.next_match()
    stepped_to = show.strike(pose(T_POSE))
    show.match_session.accept()
    assert not show.match_session.matching
    assert show.moves(pose({**T_POSE, "HipLeft": (0.0, 0.0, 0.6)})) > 0.1
    show.match_session.match_again()
    assert show.match_session.matching
    assert stepped_to != best
    for _ in range(12):
        show.strike(pose(T_POSE))
    assert show.drives == best
    assert show.match_session.matching


def test_a_puppet_performs_on_while_another_match_is_looked_for(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=math.inf))
    show.strike(pose(T_POSE))
    show.match_session.accept()
    bent = pose({**T_POSE, "ElbowLeft": (0.0, 0.0, 1.2)})
    moved = show.moves(bent)
    assert moved > 0.1
    show.match_session.match_again()
    show.strike(pose(T_POSE))
    assert show.moves(bent) > 0.5 * moved
    (highlight, *_) = puppet.highlights
    assert puppet.proposal is not None
    assert highlight.joints == show.drives[0].source[1:]
    show.match_session.keep()
    assert puppet.proposal is None
    assert not show.match_session.matching
    assert show.moves(bent) == pytest.approx(moved, rel=0.05)


def test_only_a_pose_that_is_kept_still_accepts_itself(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices(patience=0.75, stray=0.15))
    for step in range(30):  # an arm that waves on; the match stays the same
        show.strike(pose({**T_POSE, "ElbowLeft": (0.0, 0.0, 0.6 * (step % 3))}))
        assert not show.match_session.counts
    assert show.match_session.matching
    left, counts = [], []
    while show.match_session.matching:
        show.strike(pose(T_POSE))
        left.append(show.match_session.countdown)
        counts.append(show.match_session.counts)
    assert counts[:2] == [False, False]
    assert counts[-2], "it is seen to go by"
    assert left[0] == pytest.approx(0.75)
    assert left == [*sorted(left[:-1], reverse=True), None]


def test_actions_on_the_matching_are_for_the_puppet_that_is_selected() -> None:
    puppets = [Puppet(FIGURE), Puppet(FIGURE)]
    performer = Performer(BODY)
    session = MatchSession(
        performer, puppets, lambda: FRONT_VIEW, Choices(patience=math.inf), [None, None]
    )

    def strike() -> list[tuple[Drive, ...]]:
        captured = frame(pose(T_POSE), 0.0)
        performer.follow(captured)
        session.direct(captured)
        return [mapping.drives for mapping in session.mappings]

    first, second = strike()
    session.selected = 1
    session.next_match()
    assert strike()[0] == first
    assert strike()[1] != second
    session.accept()
    session.match_again()
    assert [puppet.proposal is not None for puppet in puppets] == [False, True]
    assert [match.candidate.rank for match in session.matches] == [1, 2]


def test_the_next_match_can_be_asked_for_in_the_midst_of_a_performance(puppet: Puppet) -> None:
    show = Rehearsal(puppet, Choices())
    best = show.strike(pose(T_POSE))
    assert not show.match_session.matching
    show.match_session.next_match()
    assert show.match_session.matching
    assert show.strike(pose(T_POSE)) != best
    assert not show.match_session.matching
    show.match_session.previous_match()
    assert show.strike(pose(T_POSE)) == best


def test_a_mapping_by_hand_is_taken_as_it_is(puppet: Puppet) -> None:
    hand = Mapping(ARMS)
    show = Rehearsal(puppet, Choices(rank=9), hand)
    show.strike(pose())
    assert show.match_session.mappings[0] is hand
    assert not show.match_session.matching
    show = Rehearsal(puppet, Choices(), hand)
    show.rehearse([seen(positions) for positions in waving(3)])
    assert show.match_session.mappings[0] is hand


def test_a_rehearsal_takes_the_pose_most_like_the_puppet(puppet: Puppet) -> None:
    """The puppet holds its arms level; so does one of the poses, which becomes the rest state."""
    poses = [seen(pose(turns)) for turns in ({}, {"ElbowLeft": (0, 0, 1.5)}, T_POSE)]
    show = Rehearsal(puppet, Choices(), Mapping(ARMS))
    reaches = show.rehearse(poses)
    assert not show.match_session.matching
    assert [reach.path.shape for reach in reaches] == [(2, 3)]
    assert show.moves(pose(T_POSE)) < 1e-9
    assert show.moves(pose()) > 0.2


@pytest.mark.parametrize("heading", [-2.0, 1.0])
def test_a_rehearsed_performer_is_seen_facing_the_stage(puppet: Puppet, heading: float) -> None:
    runs = []
    for turn in (0.0, heading):
        show = Rehearsal(puppet, Choices())
        show.rehearse([seen(pose(T_POSE, heading=turn))])
        runs.append((show.drives, show.moves(pose(T_POSE))))
    assert runs[0][0] == runs[1][0]
    assert max(moved for _, moved in runs) < 1e-9


def test_each_rehearsed_pose_is_matched_by_itself(puppet: Puppet) -> None:
    """What comes first does not bind: the match is that of the pose that suits best."""
    alone = Rehearsal(puppet, Choices())
    alone.rehearse([seen(pose(T_POSE))])
    best = alone.drives
    first = Rehearsal(puppet, Choices())
    first.rehearse([seen(pose(UPSIDE_DOWN))])
    assert first.drives != best
    both = Rehearsal(puppet, Choices())
    both.rehearse([seen(pose(UPSIDE_DOWN)), seen(pose(T_POSE))])
    assert both.drives == best


def test_chains_can_stop_where_the_part_ends_and_turns_can_be_mirrored(puppet: Puppet) -> None:
    whole = Rehearsal(puppet, Choices(flip=True))
    whole.strike(pose(T_POSE))
    assert all(drive.flip for drive in whole.match_session.mappings[0].drives)
    stopped = Rehearsal(puppet, Choices(extend=False))
    stopped.strike(pose(T_POSE))
    lengths = (
        [len(drive.target) for drive in whole.drives],
        [len(drive.target) for drive in stopped.drives],
    )
    assert not any(drive.flip for drive in stopped.match_session.mappings[0].drives)
    assert sum(lengths[1]) <= sum(lengths[0])
