"""Likeness of limbs on the screen, and the choice of the most different poses."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.retarget.limb_shapes import most_different_poses, shape_likeness

FRONT = np.eye(3)
BENT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
STRAIGHT = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]])


def test_a_polyline_is_like_itself() -> None:
    assert shape_likeness(BENT, BENT, FRONT, FRONT) == pytest.approx(1.0)


def test_a_bent_limb_is_less_like_a_straight_one_that_leads_to_the_same_place() -> None:
    assert shape_likeness(BENT, STRAIGHT, FRONT, FRONT) == pytest.approx(np.sqrt(0.5))


def test_opposite_limbs_are_unlike() -> None:
    assert shape_likeness(BENT, -BENT, FRONT, FRONT) == pytest.approx(-1.0)


def test_a_limb_that_leads_into_the_depth_is_neither() -> None:
    away = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert shape_likeness(away, STRAIGHT, FRONT, FRONT) == pytest.approx(0.0)
    assert shape_likeness(np.zeros((3, 3)), STRAIGHT, FRONT, FRONT) == 0.0


@given(st.floats(0.01, 100.0), st.integers(1, 6))
def test_size_place_and_sampling_do_not_matter(size: float, parts: int) -> None:
    finer = np.concatenate(
        [np.linspace(a, b, parts, endpoint=False) for a, b in pairwise(BENT)] + [BENT[-1:]]
    )
    moved = size * finer + [3.0, -2.0, 5.0]
    assert shape_likeness(moved, BENT, FRONT, FRONT) == pytest.approx(1.0)


def test_the_extremes_of_a_swing_are_among_the_poses_that_differ_most() -> None:
    angles = np.concatenate([np.linspace(0.0, 0.2, 50), [2.0], np.linspace(0.2, 0.0, 50), [-2.0]])
    poses = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)[:, None]
    chosen = most_different_poses(poses, 3)
    assert chosen.tolist() == sorted(chosen.tolist())
    assert {50, 101} <= set(chosen.tolist())


def test_equal_poses_are_taken_once() -> None:
    assert len(most_different_poses(np.ones((9, 4, 3)), 5)) == 1
