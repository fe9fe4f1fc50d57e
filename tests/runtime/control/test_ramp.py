"""Ramps: the value at each moment of a move."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from runtime.control.ramp import Ramp


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 5.0

    def __call__(self) -> float:
        return self.now


def test_it_takes_its_time_and_is_half_way_in_the_middle() -> None:
    clock = Clock()
    fade = Ramp(0.4, clock)
    assert fade.level == 0.0
    fade.to(1.0)
    assert (fade.level, fade.target) == (0.0, 1.0)
    clock.now += 0.2
    assert fade.level == pytest.approx(0.5)
    clock.now += 0.2
    assert fade.level == 1.0
    fade.to(0.0)
    clock.now += 100.0
    assert fade.level == 0.0


@example([(0.109375, 1.0), (0.5, 0.0)])
@given(st.lists(st.tuples(st.floats(0.0, 0.5), st.sampled_from([0.0, 1.0])), max_size=20))
def test_it_never_jumps_however_often_it_is_turned_round(turns: list[tuple[float, float]]) -> None:
    clock = Clock()
    fade = Ramp(0.4, clock)
    for wait, target in turns:
        before = fade.level
        fade.to(target)
        assert fade.level == pytest.approx(before, abs=1e-9)
        steps = [before]
        for _ in range(10):
            clock.now += wait / 10.0
            steps.append(fade.level)
        assert all(0.0 <= level <= 1.0 for level in steps)
        fastest = 1.5 / 0.4 * wait / 10.0  # smoothstep's steepest, over the whole way
        assert max(abs(b - a) for a, b in itertools.pairwise(steps)) <= fastest + 1e-9
