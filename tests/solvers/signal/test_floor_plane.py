"""The plane of the floor, from places where feet stood."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.signal.floor_plane import MEMORY, STEEPEST, FloorFit


def steps(slope: tuple[float, float], height: float, spread: float, count: int) -> np.ndarray:
    places = np.random.default_rng(0).uniform(-spread, spread, (count, 2))
    heights = places @ slope + height
    return np.column_stack([places[:, 0], heights, places[:, 1]])


def test_no_step_is_a_level_floor_at_zero() -> None:
    assert FloorFit().plane() == (0.0, 0.0, 0.0)


def test_one_place_tells_the_height_only() -> None:
    fit = FloorFit()
    for _ in range(100):
        fit.add(np.array([[2.0, -0.9, 3.0]]), 0.1)
    a, b, c = fit.plane()
    assert (a, b) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert c == pytest.approx(-0.9)


@pytest.mark.parametrize("slope", [(0.2, 0.0), (-0.1, 0.3)])
def test_a_walk_tells_the_slope(slope: tuple[float, float]) -> None:
    fit = FloorFit()
    for point in steps(slope, -0.7, 1.5, 600):
        fit.add(point[None], 1 / 30)
    a, b, c = fit.plane()
    assert (a, b) == pytest.approx(slope, rel=0.15, abs=0.03)
    at = steps(slope, -0.7, 0.5, 9)
    np.testing.assert_allclose(a * at[:, 0] + b * at[:, 2] + c, at[:, 1], atol=0.05)


def test_what_is_steeper_is_no_floor() -> None:
    fit = FloorFit()
    for point in steps((5.0, 0.0), 0.0, 3.0, 300):
        fit.add(point[None], 1 / 30)
    assert np.hypot(*fit.plane()[:2]) <= STEEPEST + 1e-9


def test_old_steps_are_forgotten() -> None:
    fit = FloorFit()
    fit.add(np.array([[0.0, 1.0, 0.0]]), 1.0)
    fit.add(np.array([[0.0, 0.0, 0.0]]), 5 * MEMORY)
    assert fit.plane()[2] < 0.02
