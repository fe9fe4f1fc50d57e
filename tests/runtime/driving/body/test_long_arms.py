"""Wings that would reach below the floor lie on it; of arms that just reach it, only the hands."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from devices.bodies.joint_names import Side
from runtime.driving.body.body_parts import Arm, Leg
from runtime.driving.body.long_arms import LongArms
from solvers.skeleton.tree import Tree

# hips, knee, ankle; shoulder, elbow, tip of a wing that is longer than the shoulder is high
NODES = np.array(
    [
        [0.1, 0.5, 0.0],
        [0.1, 0.25, 0.0],
        [0.1, 0.0, 0.0],
        [0.2, 0.8, 0.0],
        [0.9, 0.8, 0.0],
        [1.6, 0.8, 0.0],
    ]
)
PARENTS = np.array([-1, 0, 1, 0, 3, 4])
LEG = Leg((0, 1, 2, 2), (0, 1, 2, 2), (2, 3, -1), is_bent=False)
LEFT = np.array([1.0, 0.0, 0.0])
WING = Arm(Side.LEFT, (3, 4, 5), (0, 1), (3, 4), 5)


def lying(arm: Arm = WING) -> LongArms:
    """A wing whose surface is 0.016 around its bones."""
    offsets = np.array([[0.0, 0.016, 0.0], [0.0, -0.016, 0.0]])
    vertices = NODES[arm.target[-2]] + offsets
    owner = np.full(2, arm.target[-2])
    return LongArms(
        Tree(PARENTS[: arm.target[-1] + 1], NODES[: arm.target[-1] + 1]),
        vertices,
        owner,
        [arm],
        [LEG],
    )


def hung(turn: Rotation) -> tuple[np.ndarray, np.ndarray]:
    """The nodes with the wing turned about its shoulder, and their rotations."""
    positions, rotations = NODES.copy(), np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))
    positions[3:] = NODES[3] + turn.apply(NODES[3:] - NODES[3])
    rotations[3:] = turn.as_quat()
    return positions, rotations


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_a_wing_stays_above_the_floor_and_points_as_before_where_it_is(
    about_y: float, about_z: float
) -> None:
    positions, rotations = hung(Rotation.from_euler("zy", [-about_z, about_y]))
    turns = np.zeros((4, 4))
    raised = lying().raise_arms(positions, rotations, turns, LEFT, 0.0)
    assert raised == (positions[5, 1] < 0.016)
    if raised:
        tip = positions[3] + Rotation.from_quat(turns[0]).apply(NODES[5] - NODES[3])
        assert tip[1] == pytest.approx(0.016, abs=1e-9)
        np.testing.assert_allclose(turns[0], turns[1], atol=1e-12)


def test_it_begins_where_the_floor_begins() -> None:
    edge = np.arcsin((0.8 - 0.016) / 1.4)
    wing = lying()
    turns = np.zeros((4, 4))
    below = Rotation.from_euler("z", -(edge + 1e-6))
    assert wing.raise_arms(*hung(below), turns, LEFT, 0.0)
    assert (Rotation.from_quat(turns[0]) * below.inv()).magnitude() < 1e-4


def test_an_arm_that_does_not_reach_the_floor_is_let_be() -> None:
    short = Arm(Side.LEFT, (3, 4), (0,), (3,), 4)
    positions, rotations = hung(Rotation.from_euler("z", -np.pi / 2.0))
    assert not lying(short).raise_arms(positions, rotations, np.zeros((4, 4)), LEFT, 0.0)


def test_hands_may_be_below_feet_that_are_in_the_air() -> None:
    positions, rotations = hung(Rotation.from_euler("z", -np.pi / 2.0))
    assert lying().raise_arms(positions, rotations, np.zeros((4, 4)), LEFT, 0.3)
    assert not lying().raise_arms(positions, rotations, np.zeros((4, 4)), LEFT, 0.7)


def test_a_hanging_wing_of_a_bird_whose_shoulders_are_ahead_of_its_feet_lies_to_its_side() -> None:
    positions, rotations = hung(Rotation.from_euler("z", -np.pi / 2.0))
    positions[3:, 2] += 0.5
    turns = np.zeros((4, 4))
    assert lying().raise_arms(positions, rotations, turns, LEFT, 0.0)
    way = Rotation.from_quat(turns[0]).apply(NODES[5] - NODES[3])
    assert way[0] > 1.0
    assert way[2] == pytest.approx(0.0, abs=1e-9)


def test_a_foreleg_that_reaches_below_the_floor_slides_forward() -> None:
    standing = NODES.copy()
    standing[3:] = [[0.2, 0.8, 0.5], [0.2, 0.4, 0.5], [0.2, 0.0, 0.5]]
    offsets = np.array([[0.016, 0.0, 0.0], [-0.016, 0.0, 0.0]])
    foreleg = LongArms(Tree(PARENTS, standing), standing[4] + offsets, np.full(2, 4), [WING], [LEG])
    low, turns = standing.copy(), np.zeros((4, 4))
    low[3:, 1] -= 0.2
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))
    assert foreleg.raise_arms(low, rotations, turns, LEFT, 0.0)
    way = Rotation.from_quat(turns[0]).apply(low[5] - low[3])
    assert way[2] > 0.3
    assert way[0] == pytest.approx(0.0, abs=1e-9)


def test_an_arm_that_just_reaches_the_floor_points_right_and_its_hand_gives_way() -> None:
    straight = Rotation.from_euler("z", -np.pi / 2.0)
    nodes = np.append(NODES, [[0.0, 0.8, 0.0]], axis=0)
    nodes[4:, 0] = [0.6, 0.92, 1.07]  # 0.87 from the shoulder, which is 0.8 high
    reaching = Arm(Side.LEFT, (3, 4, 5, 6), (0, 1, 2), (3, 4, 5), 5)
    arm = LongArms(Tree(np.append(PARENTS, 5), nodes), nodes[5:6], np.array([5]), [reaching], [LEG])
    positions, rotations = nodes.copy(), np.tile(straight.as_quat(), (7, 1))
    positions[3:] = nodes[3] + straight.apply(nodes[3:] - nodes[3])
    turns = np.zeros((4, 4))
    assert arm.raise_arms(positions, rotations, turns, LEFT, 0.0)
    assert not turns[:2].any(), "neither upper arm nor forearm"
    tip = positions[5] + Rotation.from_quat(turns[2]).apply(nodes[6] - nodes[5])
    assert tip[1] == pytest.approx(0.0, abs=1e-9)
    assert tip[0] > positions[5, 0], "outward"
    positions[3:, 1] -= 0.2  # a squat
    assert arm.raise_arms(positions, rotations, turns, LEFT, 0.0)
    assert turns[:2].any(axis=1).all()


@given(st.floats(0.0, 89.0), st.floats(0.01, 1.0))
def test_a_wing_shows_each_angle_between_hanging_and_level(angle: float, more: float) -> None:
    tips = []
    for down in (angle, min(angle + more, 90.0)):
        positions, rotations = hung(Rotation.from_euler("z", -down, degrees=True))
        turns = np.zeros((4, 4))
        if lying().spread_wings(positions, rotations, turns, LEFT, 0.0):
            np.testing.assert_allclose(turns[0], turns[1], atol=1e-12)
            way = Rotation.from_quat(turns[0]).apply(NODES[5] - NODES[3])
        else:
            way = positions[5] - positions[3]
        tips.append(positions[3] + way)
    assert tips[0][1] > tips[1][1], "still lower"
    assert tips[1][1] > 0.016 - 1e-9, "above the floor"


def test_what_points_up_of_a_wing_is_let_be() -> None:
    positions, rotations = hung(Rotation.from_euler("z", 0.3))
    turns = np.zeros((4, 4))
    assert not lying().spread_wings(positions, rotations, turns, LEFT, 0.0)
    assert not turns.any()


def test_an_arm_that_is_no_wing_is_not_spread() -> None:
    short = Arm(Side.LEFT, (3, 4), (0,), (3,), 4)
    positions, rotations = hung(Rotation.from_euler("z", -1.0))
    positions[3:, 1] -= 0.3  # a squat
    assert not lying(short).spread_wings(positions, rotations, np.zeros((4, 4)), LEFT, 0.0)
