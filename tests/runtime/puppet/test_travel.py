"""A character that stays in place goes nowhere, and never jumps when that is changed."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.driving.targets import Placement
from runtime.puppet.travel import SECONDS, Travel
from tests.runtime.snapshots import digest

AWAY = Placement(turn=0.4, travel=(3.0, -2.0), lift=0.1)
RATE = 30


def walk(travel: Travel, frames: range) -> np.ndarray:
    """Where a character is in each of these frames (T, 2) [m]."""
    ways = []
    for frame in frames:
        travel.follow(frame / RATE)
        ways.append(travel.of(AWAY).travel)
    return np.array(ways)


def test_who_travels_goes_the_whole_way() -> None:
    travel = Travel()
    assert (walk(travel, range(10)) == AWAY.travel).all()
    assert travel.of(AWAY) is AWAY


def test_who_starts_in_place_stays_there_and_only_there() -> None:
    travel = Travel()
    travel.in_place = True
    assert (walk(travel, range(10)) == 0.0).all()
    kept = travel.of(AWAY)
    assert (kept.turn, kept.lift) == (AWAY.turn, AWAY.lift)


def test_the_way_home_and_back_is_eased() -> None:
    travel = Travel()
    frames = int(SECONDS * RATE)
    walk(travel, range(10))
    travel.in_place = True
    home = walk(travel, range(10, 11 + frames))
    assert (home[-1] == 0.0).all()
    travel.in_place = False
    back = walk(travel, range(11 + frames, 12 + 2 * frames))
    assert (back[-1] == AWAY.travel).all()
    steps = np.linalg.norm(np.diff(np.vstack([[AWAY.travel], home, back]), axis=0), axis=1)
    assert steps.max() < 1.7 * np.hypot(*AWAY.travel) / frames, (
        "no step is much more than its share"
    )


def test_a_change_on_the_way_turns_round_where_it_is() -> None:
    travel = Travel()
    walk(travel, range(5))
    travel.in_place = True
    half = walk(travel, range(5, 12))[-1]
    travel.in_place = False
    again = walk(travel, range(12, 13))[-1]
    assert 0.0 < half[0] < 3.0
    assert np.abs(again - half).max() < 0.5


def test_a_pause_of_the_stream_is_no_jump() -> None:
    travel = Travel()
    travel.follow(0.0)
    travel.in_place = True
    travel.follow(60.0)
    assert travel.of(AWAY).travel[0] > 2.0


@pytest.mark.parametrize("done", [3, 9])
def test_a_snapshot_goes_on_the_same(done: int) -> None:
    travel, other = Travel(), Travel()
    walk(travel, range(5))
    travel.in_place = other.in_place = True
    walk(travel, range(5, 5 + done))
    state = travel.snapshot()
    went = walk(travel, range(5 + done, 30))
    walk(other, range(2))
    other.restore(state)
    assert digest(other.snapshot()) == digest(state)
    np.testing.assert_array_equal(walk(other, range(5 + done, 30)), went)
