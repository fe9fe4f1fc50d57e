from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.posture import likeness

FRONT = np.eye(3)
BENT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
STRAIGHT = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]])


def test_a_polyline_is_like_itself() -> None:
    assert likeness(BENT, BENT, FRONT, FRONT) == pytest.approx(1.0)


def test_a_bent_limb_is_less_like_a_straight_one_that_leads_to_the_same_place() -> None:
    assert likeness(BENT, STRAIGHT, FRONT, FRONT) == pytest.approx(np.sqrt(0.5))


def test_opposite_limbs_are_unlike() -> None:
    assert likeness(BENT, -BENT, FRONT, FRONT) == pytest.approx(-1.0)


def test_a_limb_that_leads_into_the_depth_is_neither() -> None:
    away = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert likeness(away, STRAIGHT, FRONT, FRONT) == pytest.approx(0.0)
    assert likeness(np.zeros((3, 3)), STRAIGHT, FRONT, FRONT) == 0.0


@given(st.floats(0.01, 100.0), st.integers(1, 6))
def test_size_place_and_sampling_do_not_matter(size: float, parts: int) -> None:
    finer = np.concatenate(
        [np.linspace(a, b, parts, endpoint=False) for a, b in pairwise(BENT)] + [BENT[-1:]]
    )
    moved = size * finer + [3.0, -2.0, 5.0]
    assert likeness(moved, BENT, FRONT, FRONT) == pytest.approx(1.0)
