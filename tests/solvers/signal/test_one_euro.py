"""The One-Euro filter: constants, lag, noise, and independence of axes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from solvers.signal.one_euro import OneEuroFilter, smoothing_factor
from tests.thorough import examples

points = arrays(np.float64, (4, 3), elements=st.floats(-10.0, 10.0))


def run(euro: OneEuroFilter, samples: np.ndarray, dt: float) -> np.ndarray:
    return np.array([euro.filter(sample, dt) for sample in samples])


@settings(max_examples=examples(50), deadline=None)
@given(points, st.floats(1e-4, 10.0))
def test_a_constant_comes_out_to_the_last_bit(still: np.ndarray, dt: float) -> None:
    np.testing.assert_array_equal(run(OneEuroFilter(), np.array([still] * 20), dt)[-1], still)


def test_the_weight_is_that_of_an_exponential_filter() -> None:
    # Of a first-order low-pass with time constant tau, sampled every dt: dt / (tau + dt).
    for cutoff, dt in ((1.0, 1 / 60), (30.0, 1 / 120), (0.1, 0.5)):
        tau = 1.0 / (2.0 * math.pi * cutoff)
        assert smoothing_factor(cutoff, dt) == pytest.approx(dt / (tau + dt))


@pytest.mark.parametrize("speed", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("rate", [30.0, 120.0])
def test_an_even_motion_lags_as_the_closed_form_says(speed: float, rate: float) -> None:
    euro, direction = OneEuroFilter(), np.array([2.0, -3.0, 6.0]) / 7.0
    times = np.arange(round(10.0 * rate)) / rate
    ramp = times[:, None, None] * speed * direction
    smooth = run(euro, ramp, 1.0 / rate)
    lag = np.linalg.norm(ramp[-1] - smooth[-1]) / speed
    cutoff = euro.min_cutoff + euro.speed_coefficient * speed
    assert lag == pytest.approx(1.0 / (2.0 * math.pi * cutoff), rel=1e-6)
    np.testing.assert_allclose(euro.velocity[0], speed * direction, rtol=1e-6)


def test_the_answer_does_not_depend_on_how_the_axes_lie() -> None:
    random = np.random.default_rng(4)
    samples = random.normal(size=(40, 5, 3)).cumsum(axis=0) * 0.02
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    straight = run(OneEuroFilter(), samples, 1 / 60)
    np.testing.assert_allclose(
        run(OneEuroFilter(), samples @ turn.T, 1 / 60), straight @ turn.T, atol=1e-12
    )


def test_noise_at_rest_is_halved_and_a_fast_move_is_followed() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.005, (600, 1, 3))
    smooth = run(OneEuroFilter(), noise, 1 / 30)
    assert smooth[30:].std() < 0.6 * noise.std()
    step = np.zeros((60, 1, 3))
    step[30:] = 1.0
    late = np.abs(run(OneEuroFilter(), step, 1 / 30) - 1.0)[30:, 0, 0]
    assert late[1] < 0.15


def test_a_sample_that_took_no_time_changes_nothing() -> None:
    one, other = OneEuroFilter(), OneEuroFilter()
    samples = np.random.default_rng(2).normal(size=(10, 3, 3))
    for sample in samples:
        expected = one.filter(sample, 1 / 60)
        np.testing.assert_array_equal(other.filter(sample, 1 / 60), expected)
        np.testing.assert_array_equal(other.filter(sample + 1.0, 0.0), expected)


def test_after_a_reset_the_first_sample_comes_out_as_it_is() -> None:
    euro = OneEuroFilter()
    run(euro, np.random.default_rng(3).normal(size=(5, 2, 3)), 1 / 60)
    euro.reset()
    np.testing.assert_array_equal(euro.filter(np.ones((2, 3)), 1 / 60), np.ones((2, 3)))


def test_other_points_than_before_are_refused() -> None:
    euro = OneEuroFilter()
    euro.filter(np.ones((3, 3)), 1 / 60)
    for count in (2, 4):
        with pytest.raises(ValueError, match=rf"\(3, 3\), got \({count}, 3\)"):
            euro.filter(np.ones((count, 3)), 1 / 60)
