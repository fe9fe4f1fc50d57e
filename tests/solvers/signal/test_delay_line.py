"""Delays: closed forms of a steady turn, jumps, and snapshots."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solvers.signal.delay_line import MOST, DelayLine


def turned(angle: float) -> np.ndarray:
    return np.array([0.0, math.sin(angle / 2.0), 0.0, math.cos(angle / 2.0)])


def both(time: float) -> np.ndarray:
    """Two bones that turn at half a radian a second."""
    return np.tile(turned(0.5 * time), (2, 1))


def test_each_rotation_is_as_it_was_its_own_time_ago() -> None:
    line = DelayLine([0.0, 0.25])
    for step in range(60):
        now, late = line.follow(step / 30.0, both(step / 30.0))
    np.testing.assert_allclose(now, turned(0.5 * 59 / 30.0))
    np.testing.assert_allclose(late, turned(0.5 * (59 / 30.0 - 0.25)), atol=1e-6)


def test_before_the_first_frame_all_was_as_in_the_first() -> None:
    line = DelayLine([0.0, 1.0])
    line.follow(0.0, both(0.3))
    np.testing.assert_allclose(line.follow(0.1, both(2.0))[1], turned(0.15))


def test_opposite_signs_of_the_same_turn_are_no_turn() -> None:
    line = DelayLine([0.05])
    line.follow(0.0, turned(0.4)[None])
    late = line.follow(0.1, -turned(0.4)[None])[0]
    assert abs(late @ turned(0.4)) == pytest.approx(1.0)


def test_without_delays_rotations_pass_as_they_are() -> None:
    line, given = DelayLine([0.0, 0.0]), both(1.0)
    assert line.follow(1.0, given) is given
    assert DelayLine([1.0, 1.0]).follow(math.nan, given) is given


def test_a_jump_back_begins_anew() -> None:
    line = DelayLine([0.0, 0.5])
    for step in range(30):
        line.follow(10.0 + step / 30.0, both(step / 30.0))
    np.testing.assert_allclose(line.follow(3.0, both(7.0))[1], turned(3.5))


def test_the_same_moment_again_replaces_what_was_then() -> None:
    line = DelayLine([0.1])
    line.follow(0.0, turned(0.0)[None])
    line.follow(0.1, turned(9.0)[None])
    line.follow(0.1, turned(1.0)[None])
    np.testing.assert_allclose(line.follow(0.2, turned(2.0)[None])[0], turned(1.0), atol=1e-12)


def test_no_more_is_remembered_than_the_longest_delay_needs() -> None:
    line = DelayLine([MOST])
    for step in range(1000):
        late = line.follow(step / 30.0, turned(step / 300.0)[None])[0]
    np.testing.assert_allclose(late, turned((999 / 30.0 - MOST) / 10.0), atol=1e-9)
    assert len(line.snapshot().times) <= 30 * MOST + 2


def test_after_a_snapshot_everything_goes_on_alike() -> None:
    line = DelayLine([0.0, 0.3])
    for step in range(20):
        line.follow(step / 30.0, both(step / 30.0))
    state = line.snapshot()
    first = [line.follow(t / 30.0, both(t / 30.0)).tobytes() for t in range(20, 40)]
    line.restore(state)
    assert first == [line.follow(t / 30.0, both(t / 30.0)).tobytes() for t in range(20, 40)]
