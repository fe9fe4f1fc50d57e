"""A character turns as a whole, rises as a whole, and never sinks into the floor."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.retarget.ground_contact import place_above_floor, place_on_floor, turned_rotations
from solvers.retarget.heading import turned

POINTS = np.random.default_rng(0).normal(size=(50, 3))
LOWEST = float(POINTS[:, 1].min())
UP = np.array([0.0, 1.0, 0.0])
ABOUT = np.array([0.3, 0.7, -0.2])


@pytest.mark.parametrize(
    ("lift", "rise"), [(5.0, 5.0), (-LOWEST, -LOWEST), (0.1, -LOWEST), (-9.0, -LOWEST)]
)
def test_it_rises_as_far_as_it_is_lifted_or_the_floor_pushes(lift: float, rise: float) -> None:
    out = np.empty_like(POINTS)
    assert place_on_floor(POINTS, 0.8, ABOUT, lift, out) == rise
    np.testing.assert_allclose(out, turned(POINTS, 0.8, ABOUT) + UP * rise, atol=1e-14)
    assert out[:, 1].min() >= 0.0


def test_it_turns_as_a_rotation_about_the_vertical_does() -> None:
    whole, out = Rotation.from_rotvec([0.0, -2.1, 0.0]), np.empty_like(POINTS)
    place_on_floor(POINTS, -2.1, ABOUT, 9.0, out)
    expected = whole.apply(POINTS - ABOUT) + ABOUT + UP * 9.0
    np.testing.assert_allclose(out, expected, atol=1e-14)
    own = Rotation.random(5, random_state=2)
    turns = turned_rotations(own.as_quat(), -2.1)
    np.testing.assert_allclose(
        Rotation.from_quat(turns).as_matrix(), (whole * own).as_matrix(), atol=1e-14
    )


@pytest.mark.parametrize("clearance", [0.0, 0.37])
def test_the_lowest_point_is_put_as_high_as_asked(clearance: float) -> None:
    out, same = np.empty_like(POINTS), np.empty_like(POINTS)
    rise = place_above_floor(POINTS, 0.8, ABOUT, clearance, out)
    assert rise == clearance - LOWEST
    assert out[:, 1].min() == pytest.approx(clearance, abs=1e-15)
    place_on_floor(POINTS, 0.8, ABOUT, rise, same)
    np.testing.assert_array_equal(out, same)
    raised = POINTS + UP * 5.0  # it also comes down
    assert place_above_floor(raised, 0.0, ABOUT, clearance, out) == pytest.approx(rise - 5.0)
