"""Hands that flip are steadied; hands that move pass unchanged."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.retarget.steady_ends import SteadyEnds
from tests.runtime.snapshots import digest, leaves

RATE = 30.0
WRIST = np.array([0.3, 1.0, 0.1])


def hand(degrees: float) -> np.ndarray:
    """A wrist and the tip of a hand (2, 3), turned about the vertical."""
    angle = np.radians(degrees)
    return np.array([WRIST, WRIST + 0.09 * np.array([np.sin(angle), 0.0, np.cos(angle)])])


def steadied(ends: SteadyEnds, angles: list[float], rate: float = RATE) -> np.ndarray:
    out = []
    for number, angle in enumerate(angles):
        joints = hand(angle)
        ends.steady(joints, number / rate)
        way = joints[1] - joints[0]
        assert np.linalg.norm(way) == pytest.approx(0.09)
        out.append(np.degrees(np.arctan2(way[0], way[2])))
    return np.array(out)


@pytest.mark.parametrize("rate", [30.0, 120.0])
def test_a_hand_that_turns_by_550_degrees_a_second_passes_unchanged(rate: float) -> None:
    angles = (550.0 / rate * np.arange(int(0.3 * rate))).tolist()
    np.testing.assert_allclose(steadied(SteadyEnds([0], [1]), angles, rate), angles, atol=1e-9)


def test_a_flip_of_one_frame_is_a_twitch() -> None:
    shown = steadied(SteadyEnds([0], [1]), [0.0] * 5 + [74.0] + [0.0] * 10)
    assert shown.max() < 25.0
    assert np.abs(shown[-5:]).max() < 1e-9


def test_a_turn_that_lasts_is_followed_without_a_jump() -> None:
    shown = steadied(SteadyEnds([0], [1]), [0.0] * 5 + [150.0] * 15)
    assert np.diff(shown).max() < 45.0
    np.testing.assert_allclose(shown[-3:], 150.0, atol=1e-6)


def test_opposite_ways_and_joints_in_one_place_are_finite() -> None:
    ends = SteadyEnds([0], [1])
    assert np.isfinite(steadied(ends, [0.0, 180.0, 0.0])).all()
    joints = np.array([WRIST, WRIST])
    ends.steady(joints, 0.1)
    assert (joints == WRIST).all()


@pytest.mark.parametrize("then", [-1.0, 9.0, np.nan])
def test_all_passes_where_time_leaps(then: float) -> None:
    ends = SteadyEnds([0], [1])
    steadied(ends, [0.0] * 3)
    joints = hand(120.0)
    ends.steady(joints, then)
    np.testing.assert_array_equal(joints, hand(120.0))


def test_going_on_from_a_snapshot_gives_the_same() -> None:
    ends = SteadyEnds([0], [1])
    steadied(ends, [0.0, 70.0, 10.0])
    state = ends.snapshot()
    before = digest(state)
    assert list(leaves(state))

    def go_on() -> list[float]:
        out = []
        for number in range(3, 8):
            joints = hand(60.0 * (number % 2))
            ends.steady(joints, number / RATE)
            out += joints.ravel().tolist()
        return out

    first = go_on()
    assert digest(state) == before
    ends.reset()
    ends.restore(state)
    assert go_on() == first
