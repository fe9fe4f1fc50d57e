"""A performer who stands, sits or lies is on the floor; one who jumps is as high as they jump."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.retarget.clearance import JUMPS, STANDS, clearance

TALL = 1.7
NO_FEET = np.zeros((0, 2))


def jump(height: float) -> float:
    joints = np.array([[0.0, 0.9 + height, 0.0], [0.0, 0.5 + height, 0.0]])
    return clearance(np.full((2, 2), height), joints, 0.0, TALL, rise=height)


@pytest.mark.parametrize("height", [-0.1, 0.0, 0.02, STANDS * TALL])
def test_a_performer_who_stands_is_on_the_floor(height: float) -> None:
    assert jump(height) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("height", [JUMPS * TALL, 0.3, 0.7])
def test_a_jump_is_as_high_as_the_performers(height: float) -> None:
    joints = np.array([[0.0, 0.9 + height, 0.0]])
    got = clearance(np.full((2, 2), height), joints, 0.0, TALL, rise=height)
    assert got == pytest.approx(height)


@given(st.floats(-0.1, 0.4))
def test_it_rises_with_the_performer_and_smoothly(height: float) -> None:
    less, more = jump(height), jump(height + 1e-4)
    assert 0.0 <= less <= more <= less + 3.5e-4


def test_one_foot_on_the_floor_is_enough() -> None:
    joints = np.array([[0.0, 0.9, 0.0]])
    feet = np.array([[0.3, 0.4], [0.1, 0.0]])
    assert clearance(feet, joints, 0.0, TALL, rise=0.3) == 0.0


@pytest.mark.parametrize("rests", [0.05, 0.11])
def test_who_sits_or_lies_is_on_the_floor(rests: float) -> None:
    joints = np.array([[0.0, rests, 0.0], [0.4, 0.3, 0.0]])
    assert clearance(np.full((2, 2), 0.4), joints, 0.0, TALL, rise=0.4) == 0.0


def test_a_body_without_feet_stands_on_its_joints() -> None:
    joints = np.array([[0.0, 0.3, 0.0]])
    above = clearance(NO_FEET, joints, 0.0, TALL, rise=0.3)
    assert above == pytest.approx(0.3 - 0.05 * TALL)
    assert clearance(NO_FEET, joints, 0.25, TALL, rise=0.3) == 0.0


def test_feet_that_rise_without_the_trunk_make_no_jump() -> None:
    joints, feet = np.array([[0.0, 0.9, 0.0]]), np.full((2, 2), 0.3)
    assert clearance(feet, joints, 0.0, TALL, rise=0.01) == 0.0
    assert clearance(feet, joints, 0.0, TALL, rise=-0.2) == 0.0


def test_legs_drawn_up_in_a_jump_are_higher_than_the_trunk_rises() -> None:
    joints, feet = np.array([[0.0, 1.1, 0.0]]), np.full((2, 2), 0.4)
    assert clearance(feet, joints, 0.0, TALL, rise=0.2) == pytest.approx(0.4)
