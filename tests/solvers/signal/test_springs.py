"""Springs follow their differential equation, in steps of any length."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.signal.springs import Springs

SECONDS = st.floats(1e-4, 0.5)


def test_a_spring_solves_its_equation():
    """x'' = w^2 (target - x) - 2 d w x', checked by differences of the exact path."""
    omega, damping, h = 2.0 * math.pi * 3.0, 0.35, 1e-4
    path = []
    springs = Springs([0.0], frequency=3.0, damping=damping)
    for _ in range(4000):
        path.append(springs.step([1.0], h)[0])
    x = np.array(path)
    speed, push = np.gradient(x, h), np.gradient(np.gradient(x, h), h)
    expected = omega**2 * (1.0 - x) - 2.0 * damping * omega * speed
    np.testing.assert_allclose(push[5:-5], expected[5:-5], atol=2e-2 * omega**2 * 0.01)


def test_it_overshoots_once_as_the_damping_says_and_comes_to_rest():
    springs = Springs([0.0], frequency=2.0, damping=0.35)
    path = [springs.step([1.0], 0.001)[0] for _ in range(8000)]
    overshoot = math.exp(-math.pi * 0.35 / math.sqrt(1.0 - 0.35**2))
    assert max(path) == pytest.approx(1.0 + overshoot, abs=1e-4)
    assert path[-1] == pytest.approx(1.0, abs=1e-6)


@given(SECONDS, SECONDS, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_two_steps_are_one(first: float, second: float, start: float, target: float):
    whole = Springs([start], frequency=3.0, damping=0.35)
    halves = Springs([start], frequency=3.0, damping=0.35)
    whole.speed[:] = halves.speed[:] = 0.7
    whole.step([target], first + second)
    halves.step([target], first)
    halves.step([target], second)
    np.testing.assert_allclose(halves.at, whole.at, atol=1e-9)
    np.testing.assert_allclose(halves.speed, whole.speed, atol=1e-8)
