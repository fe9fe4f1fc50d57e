"""A limb of two bones reaches its goal, keeps its lengths and its side, and stays finite."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.retarget.two_bone_ik import (
    GIVE,
    NEARLY,
    soft_reach,
    two_bone_turns,
    within_reach,
)

LEFT = np.array([1.0, 0.0, 0.0])
STRAIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.1, 0.0]])
BENT = np.array([[0.0, 1.0, 0.0], [0.0, 0.6, 0.3], [0.0, 0.1, 0.1]])

points = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


def moved(limb: np.ndarray, goal: np.ndarray, axis: np.ndarray = LEFT) -> np.ndarray:
    """The limb after its turns."""
    turns = two_bone_turns(limb[None], goal[None], axis[None])[0]
    np.testing.assert_allclose(np.linalg.norm(turns, axis=1), 1.0, atol=1e-12)
    knee = limb[0] + Rotation.from_quat(turns[0]).apply(limb[1] - limb[0])
    return np.array([limb[0], knee, knee + Rotation.from_quat(turns[1]).apply(limb[2] - limb[1])])


def test_a_right_angle_in_closed_form() -> None:
    """Thigh 0.5 and shin 0.5 with the ankle 0.5 * sqrt(2) below the hip: 45 degrees each."""
    limb = np.array([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.0]])
    after = moved(limb, np.array([0.0, 1.0 - np.sqrt(0.5), 0.0]))
    half = 0.5 * np.sqrt(0.5)
    np.testing.assert_allclose(after[1], [0.0, 1.0 - half, half], atol=1e-12)


@pytest.mark.parametrize("limb", [STRAIGHT, BENT])
def test_an_ankle_that_need_not_move_turns_nothing(limb: np.ndarray) -> None:
    turns = two_bone_turns(limb[None], limb[None, 2], LEFT[None])[0]
    np.testing.assert_allclose(turns, [[0.0, 0.0, 0.0, 1.0]] * 2, atol=1e-7)


def test_a_straight_leg_bends_forward_whatever_its_noise() -> None:
    for noise in (0.0, 0.002, -0.002):
        limb = STRAIGHT.copy()
        limb[1, 2] += noise
        assert moved(limb, np.array([0.0, 0.3, 0.0]))[1, 2] > 0.1


def test_a_bent_limb_keeps_its_own_side() -> None:
    backward = BENT * (1.0, 1.0, -1.0)  # like an elbow
    after = moved(backward, np.array([0.0, 0.4, 0.0]))
    assert after[1, 2] < -0.1
    np.testing.assert_allclose(after[:, 0], 0.0, atol=1e-12)


@given(points, points, points, points)
def test_it_reaches_what_is_in_reach(
    hip: np.ndarray, knee: np.ndarray, ankle: np.ndarray, goal: np.ndarray
) -> None:
    upper, lower = np.linalg.norm(knee - hip), np.linalg.norm(ankle - knee)
    limb = np.array([hip, knee, ankle])
    after = moved(limb, goal)
    assert np.isfinite(after).all()
    if min(upper, lower) < 1e-3:
        return
    far = np.linalg.norm(goal - hip)
    reached = np.linalg.norm(after[2] - hip)
    assert reached == pytest.approx(np.clip(far, abs(upper - lower), upper + lower), abs=1e-6)
    if far > 1e-3:
        aside = np.linalg.norm(np.cross(after[2] - hip, goal - hip)) / far
        assert aside == pytest.approx(0.0, abs=1e-6)


def test_joints_at_one_place_give_finite_turns() -> None:
    for limb in (np.zeros((3, 3)), np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0.0]])):
        for goal in (np.zeros(3), LEFT):
            for axis in (LEFT, np.zeros(3)):
                assert np.isfinite(two_bone_turns(limb[None], goal[None], axis[None])).all()


def test_turns_change_little_where_the_goal_does() -> None:
    """No snap: the knee of a bent leg moves smoothly while its goal leaves its reach."""
    hip, ankle = tuple(BENT[0]), tuple(BENT[2])
    length = float(np.linalg.norm(np.diff(BENT, axis=0), axis=1).sum())
    knees = []
    for far in np.linspace(0.85, 1.3, 451) * length:
        goal = np.array(within_reach(hip, ankle, (0.0, 1.0 - far, 0.0), length))
        knees.append(moved(BENT, goal)[1])
    assert np.linalg.norm(np.diff(knees, axis=0), axis=1).max() < 0.006


@given(st.floats(0.5, 1.0), st.floats(0.5, 3.0))
def test_the_soft_limit(own: float, wanted: float) -> None:
    reach = soft_reach(wanted, own, 1.0)
    assert reach <= 1.0
    if wanted <= own:
        assert reach == wanted
    assert soft_reach(wanted + 1e-6, own, 1.0) >= reach
    assert soft_reach(wanted + 1e-6, own, 1.0) <= reach + 1.001e-6


@given(points, points)
def test_a_goal_within_reach_keeps_its_place_on_the_ground(
    ankle: np.ndarray, goal: np.ndarray
) -> None:
    length = float(np.linalg.norm(ankle)) + 0.05
    out = np.array(within_reach((0.0, 0.0, 0.0), tuple(ankle), tuple(goal), length))
    assert np.linalg.norm(out) <= length + 1e-12
    if np.hypot(goal[0], goal[2]) < length - 0.05:
        np.testing.assert_array_equal(out[[0, 2]], goal[[0, 2]])
    own, far = np.linalg.norm(ankle), np.linalg.norm(goal)
    if far <= own:
        assert far <= np.linalg.norm(out) + 1e-9 <= max(own, far + GIVE * length) + 2e-9
        if own <= NEARLY * length:
            np.testing.assert_array_equal(out, goal)
    same = within_reach((0.0, 0.0, 0.0), tuple(ankle), tuple(ankle), length)
    np.testing.assert_allclose(same, ankle, atol=1e-12)


def test_a_straight_leg_whose_goal_is_a_little_too_near_hardly_bends() -> None:
    leg = STRAIGHT - STRAIGHT[0]
    near = (0.0, -0.894, 0.0)  # 6 mm of 0.9 m
    goal = within_reach((0.0, 0.0, 0.0), tuple(leg[2]), near, 0.9)
    bent = moved(leg, np.array(near))[1, 2]
    assert moved(leg, np.array(goal))[1, 2] < 0.5 * bent
    assert goal[1] > -0.9
