"""Prediction one sample ahead, and points at rest."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.signal.prediction import GOES_ON, MOST, Predictor


def test_what_stands_still_stays_to_the_last_bit() -> None:
    predictor, still = Predictor(), np.random.default_rng(0).normal(size=(4, 3))
    for _ in range(5):
        np.testing.assert_array_equal(predictor.predict(still, 1 / 60), still)


@pytest.mark.parametrize("dt", [1 / 120, 1 / 60, 1 / 30, 0.1])
def test_an_even_motion_goes_on_for_one_frame_and_no_longer_than_most(dt: float) -> None:
    predictor, velocity = Predictor(), np.array([[1.0, -2.0, 0.5]])
    for step in range(400):
        place = velocity * (dt * step)
        ahead = predictor.predict(place, dt)
    np.testing.assert_allclose(ahead - place, GOES_ON * min(dt, MOST) * velocity, rtol=1e-6)


def test_a_sample_that_took_no_time_tells_no_velocity() -> None:
    predictor = Predictor()
    predictor.predict(np.zeros((1, 3)), 1 / 60)
    np.testing.assert_array_equal(predictor.predict(np.ones((1, 3)), 0.0), np.ones((1, 3)))
    predictor.reset()
    np.testing.assert_array_equal(predictor.predict(np.ones((1, 3)), 1 / 60), np.ones((1, 3)))


def test_other_points_than_before_are_refused() -> None:
    predictor = Predictor()
    predictor.predict(np.ones((3, 3)), 1 / 60)
    for count in (2, 4):
        with pytest.raises(ValueError, match=rf"\(3, 3\), got \({count}, 3\)"):
            predictor.predict(np.ones((count, 3)), 1 / 60)
