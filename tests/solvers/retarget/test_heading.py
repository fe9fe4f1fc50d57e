"""The heading of a body that turns, lies or spins."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.retarget.heading import heading, turned

BODY = np.array([[0.2, 1.4, 0.0], [-0.2, 1.4, 0.0], [0.1, 0.9, 0.0], [-0.1, 0.9, 0.0]])
PAIRS = np.array([[0, 1], [2, 3]])


@given(st.floats(-3.1, 3.1))
def test_turning_a_body_turns_its_heading(angle: float) -> None:
    assert heading(turned(BODY, angle, BODY[0]), PAIRS) == pytest.approx(angle, abs=1e-9)


def test_left_turn_is_positive() -> None:
    # A body that turns to its left faces +X; its left hand then points to -Z.
    faces_left = np.array([[0.0, 1.0, -0.2], [0.0, 1.0, 0.2]])
    assert heading(faces_left, np.array([[0, 1]])) == pytest.approx(np.pi / 2)


def test_heading_counts_whole_turns() -> None:
    angle = 0.0
    for step in np.linspace(0.0, 6.0 * np.pi, 60):
        angle = heading(turned(BODY, step, np.zeros(3)), PAIRS, angle)
    assert angle == pytest.approx(6.0 * np.pi)


def test_lying_on_the_side_keeps_the_heading() -> None:
    on_the_side = np.array([[0.01, 0.4, 0.0], [0.0, 0.0, 0.0]])
    assert heading(on_the_side, np.array([[0, 1]]), 0.7) == 0.7


def test_no_pairs_keeps_the_heading() -> None:
    assert heading(BODY, np.zeros((0, 2), dtype=np.int64), 0.3) == 0.3


def test_turned_keeps_lengths_and_height() -> None:
    after = turned(BODY, 1.1, BODY[2])
    assert after[:, 1] == pytest.approx(BODY[:, 1])
    assert np.linalg.norm(after - BODY[2], axis=1) == pytest.approx(
        np.linalg.norm(BODY - BODY[2], axis=1)
    )
