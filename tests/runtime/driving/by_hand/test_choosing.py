"""Choosing pairs click by click: each click, and what any number of clicks leaves true."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from runtime.driving.by_hand.choosing import (
    Choosing,
    Pair,
    Target,
    has_group,
    mapping_of,
    pairs_of,
    phase_of,
    spread_out,
)
from runtime.driving.by_hand.parts import character_parts, performer_parts
from runtime.driving.driver import RELATIVE, DrivenPart
from runtime.driving.mapping import Mapping
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import ARMS, BODY, LEFT_ARM, LEGS, make_figure, node

LEFT, RIGHT = Target(0, 4), Target(0, 5)


def test_a_part_of_the_performer_and_one_of_a_character_make_a_pair_either_way_round() -> None:
    pair = (Pair(1, LEFT),)
    assert Choosing().click_performer(1).click_character([LEFT]) == Choosing(pair)
    assert Choosing().click_character([LEFT]).click_performer(1) == Choosing(pair)


def test_the_pair_clicked_again_is_taken_away() -> None:
    made = Choosing().click_performer(1).click_character([LEFT])
    assert made.click_performer(1).click_character([LEFT]) == Choosing()
    assert made.click_character([LEFT]).click_performer(1) == Choosing()


def test_what_waits_is_let_go_by_a_second_click_and_changed_by_another() -> None:
    assert Choosing().click_performer(1).click_performer(1) == Choosing()
    assert Choosing().click_performer(1).click_performer(2).source == 2
    assert Choosing().click_character([LEFT]).click_character([LEFT]) == Choosing()
    assert Choosing().click_character([LEFT]).click_character([RIGHT]).targets == (RIGHT,)
    assert Choosing().click_performer(1).released() == Choosing()


def test_a_part_of_a_character_has_one_driver_and_the_last_one_counts() -> None:
    made = Choosing().click_performer(1).click_character([LEFT])
    assert made.click_performer(2).click_character([LEFT]).pairs == (Pair(2, LEFT),)


def test_a_part_of_the_performer_drives_as_many_as_are_given_to_it() -> None:
    made = Choosing().click_performer(1).click_character([LEFT])
    made = made.click_performer(1).click_character([RIGHT])
    assert made.pairs == (Pair(1, LEFT), Pair(1, RIGHT))


def test_a_group_is_taken_together_and_taken_away_together() -> None:
    both = Choosing().click_performer(1).click_character([LEFT, RIGHT])
    assert both.pairs == (Pair(1, LEFT), Pair(1, RIGHT))
    assert both.click_performer(1).click_character([LEFT, RIGHT]) == Choosing()
    one = Choosing((Pair(1, LEFT),)).click_performer(1).click_character([LEFT, RIGHT])
    assert one.pairs == both.pairs, "what was missing is added"


def test_the_pairs_of_one_character_go_and_those_of_others_stay() -> None:
    other = Pair(2, Target(1, 0))
    made = Choosing((Pair(1, LEFT), other), source=3)
    assert made.cleared(0) == Choosing((other,))
    assert made.of(0) == (Pair(1, LEFT),)
    assert made.of(1) == (other,)


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 3), st.integers(0, 1)), max_size=40))
def test_no_part_of_a_character_is_ever_driven_twice(clicks: list) -> None:
    choosing = Choosing()
    for performer, chain, character in clicks:
        if performer:
            choosing = choosing.click_performer(chain)
        else:
            choosing = choosing.click_character([Target(character, chain)])
        targets = [pair.target for pair in choosing.pairs]
        assert len(set(targets)) == len(targets)
        assert choosing.source is None or not choosing.targets


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


def test_pairs_become_a_mapping_of_the_limbs_outside_the_trunk(puppet: Puppet) -> None:
    performer = performer_parts(BODY)
    parts = character_parts(puppet.character, puppet.bound_skeleton)
    arm = parts.nearest(tuple(map(node, LEFT_ARM)))
    assert arm is not None
    pairs = [Pair(performer.named("right leg"), Target(0, arm))]
    (drive,) = mapping_of(pairs, performer, parts, puppet.bound_skeleton).drives
    assert drive.source == performer.chains[performer.named("right leg")]
    assert drive.target == tuple(map(node, LEFT_ARM)), "without the bone inside the chest"


def test_what_drives_now_is_where_choosing_begins(puppet: Puppet) -> None:
    performer = performer_parts(BODY)
    parts = character_parts(puppet.character, puppet.bound_skeleton)
    driven = [DrivenPart("", "", d.source, d.target, RELATIVE) for d in (*ARMS, *LEGS)]
    pairs = pairs_of(driven, 2, performer, parts)
    assert [performer.names[pair.source] for pair in pairs] == [
        "left arm",
        "right arm",
        "left leg",
        "right leg",
    ]
    assert {pair.target.character for pair in pairs} == {2}
    again = mapping_of(pairs, performer, parts, puppet.bound_skeleton).drives
    assert [drive.target for drive in again] == [d.target for d in (*ARMS, *LEGS)]


def test_a_phase_lets_each_of_a_group_follow_later() -> None:
    left, right, leg = ARMS[0], ARMS[1], LEGS[0]
    mapping = Mapping((left, leg, left.__class__(left.source, right.target)))
    assert has_group(mapping)
    assert not has_group(Mapping(ARMS))
    spread = spread_out(mapping, 0.25)
    np.testing.assert_allclose([drive.delay for drive in spread.drives], [0.0, 0.0, 0.25])
    assert phase_of(spread) == 0.25
    assert phase_of(mapping) == 0.0
