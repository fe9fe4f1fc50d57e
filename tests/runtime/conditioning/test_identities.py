"""Performers keep their numbers, whatever numbers the sensor gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.skeleton import SkeletonFrame
from runtime.conditioning.identities import MEMORY, Identities
from runtime.conditioning.reception import MOST_AT_ONCE, Reception
from runtime.conditioning.switches import for_live
from tests.runtime.stick_figures import BODY, T_POSE, pose
from tests.thorough import examples

STEP = 1 / 30
STANDING = pose(T_POSE)


def at(
    time: float, x: float, name: int, *, size: float = 1.0, hidden: bool = False
) -> SkeletonFrame:
    positions = STANDING * size + [x, 0.0, 0.0]
    if hidden:
        positions = np.full_like(positions, np.nan)
    seen = np.isfinite(positions[:, 0]).astype(float)
    return SkeletonFrame(time, positions, None, seen, name)


def numbers(identities: Identities, *frames: SkeletonFrame) -> list[int]:
    return [frame.performer for frame in identities.steady(frames)]


def test_a_sensors_own_numbers_stay_where_nothing_is_wrong() -> None:
    identities = Identities(BODY)
    for index in range(60):
        frames = [at(index * STEP, x + 0.02 * index, name) for x, name in ((0.0, 4), (2.0, 9))]
        steady = identities.steady(frames)
        assert all(ours is theirs for ours, theirs in zip(steady, frames, strict=True))


@pytest.mark.parametrize("gone", [1, 10, 60])
def test_who_comes_back_under_a_new_number_is_known_again(gone: int) -> None:
    identities = Identities(BODY)
    for index in range(30):
        numbers(identities, at(index * STEP, 0.01 * index, 3), at(index * STEP, 2.0, 5))
    back = (29 + gone) * STEP
    for index in range(5):
        time = back + index * STEP
        assert numbers(identities, at(time, 0.3, 8), at(time, 2.0, 5)) == [3, 5]


def test_who_was_away_for_long_is_somebody_new() -> None:
    identities = Identities(BODY)
    numbers(identities, at(0.0, 0.0, 3))
    assert numbers(identities, at(1.1 * MEMORY, 0.0, 8)) == [8]


def test_a_child_in_the_place_of_an_adult_is_somebody_new() -> None:
    identities = Identities(BODY)
    numbers(identities, at(0.0, 0.0, 3))
    assert numbers(identities, at(0.5, 0.0, 8, size=0.6)) == [8]


def test_who_comes_in_far_away_is_somebody_new() -> None:
    identities = Identities(BODY)
    numbers(identities, at(0.0, 0.0, 3))
    assert numbers(identities, at(0.5, 2.5, 8)) == [8]


def test_one_who_jumps_alone_keeps_the_number() -> None:
    identities = Identities(BODY)
    numbers(identities, at(0.0, 0.0, 3))
    assert numbers(identities, at(STEP, 4.0, 3)) == [3]
    assert numbers(identities, at(2 * STEP, 0.0, 3)) == [3]


def test_one_who_is_hidden_keeps_the_number() -> None:
    identities = Identities(BODY)
    numbers(identities, at(0.0, 0.0, 3), at(0.0, 2.0, 4))
    for index in range(1, 9):
        time = index * STEP
        assert numbers(identities, at(time, 0.0, 3, hidden=True), at(time, 2.0, 4)) == [3, 4]
    assert numbers(identities, at(0.4, 0.1, 3), at(0.4, 2.0, 4)) == [3, 4]


def test_two_who_come_back_at_once_are_told_apart_together() -> None:
    identities = Identities(BODY)
    for index in range(20):
        numbers(identities, at(index * STEP, 0.0, 1), at(index * STEP, 0.7, 2))
    # The first is nearer to where the second was than to their own place.
    assert numbers(identities, at(1.5, 0.4, 11), at(1.5, 1.0, 12)) == [1, 2]


def test_two_who_pass_each_other_while_nobody_sees_them_are_told_apart() -> None:
    identities, end = Identities(BODY), 29 * STEP
    for index in range(30):
        time = index * STEP
        way = 1.5 * (time - end)
        numbers(identities, at(time, 0.4 + way, 1), at(time, 0.6 - way, 2))
    back = end + 0.3
    assert numbers(identities, at(back, 0.85, 7), at(back, 0.15, 8)) == [1, 2]


@settings(max_examples=examples(40), deadline=None)
@given(st.lists(st.permutations([5, 6, 7]), min_size=2, max_size=25), st.booleans())
def test_numbers_are_steady_when_the_sensors_are_shuffled(
    names: list[list[int]], one_at_a_time: bool
) -> None:
    identities, people = Identities(BODY), (0.0, 1.4, 2.8)
    given_out = []
    for index, shuffled in enumerate(names):
        frames = [
            at(index * STEP, x + 0.01 * index, name)
            for x, name in zip(people, shuffled, strict=True)
        ]
        batches = [[frame] for frame in frames] if one_at_a_time else [frames]
        given_out.append([n for batch in batches for n in numbers(identities, *batch)])
    assert given_out == [given_out[0]] * len(names)


def test_huge_numbers_become_small_ones_and_few_are_remembered() -> None:
    identities = Identities(BODY)
    for index in range(300):
        (number,) = numbers(identities, at(index * 0.01, 10.0 * index, 2**60 + index))
        assert 0 <= number <= 64
    assert len(identities._tracks) <= 65


def test_of_a_flood_only_the_newest_are_looked_at() -> None:
    reception = Reception(BODY, for_live())
    flood = [at(index * 1e-5, 0.0, 3) for index in range(4096)]
    let_in = reception.receive(flood)
    assert len(let_in) == MOST_AT_ONCE
    assert let_in[-1] is flood[-1]
    assert reception.receive(flood[-1:]) == [], "and that was a duplicate"
