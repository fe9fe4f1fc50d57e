"""Wings bend along their whole length as the arms bend, and never close like boards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from runtime.characters.character import Character
from runtime.characters.creatures.wings import are_wings
from runtime.characters.plan_by_shape import plan_by_shape
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.performer import Performer, rest_state
from runtime.puppet.puppet import Puppet
from solvers.skeleton.limbs import closest_bones, surface_points
from solvers.skeleton.mirror_plane import mirror_planes
from tests.runtime.capsule_bodies import (
    LEGS,
    TRUNK,
    Branches,
    both,
    capsule_body,
    character_of,
)
from tests.runtime.stick_figures import BODY, frame, paired, pose

Array = NDArray[np.float64]

ANGEL: Branches = {
    **TRUNK,
    **LEGS,
    **both("arm", "trunk", [(0.17, 1.33, 0), (1.2, 1.34, 0), (2.2, 1.33, 0)], 0.15),
}
NO_STEP = np.radians(25.0)  # between two bones


def winged(flat: float) -> Character:
    """A body with arms of two metres, which are so much thinner than wide."""
    body = capsule_body(ANGEL)
    vertices = body.vertices.copy()
    nearest, _ = closest_bones(vertices, body.tree.parents, body.tree.positions)
    arms = np.array([body.branch[node].startswith("arm") for node in nearest])
    arms &= np.abs(vertices[:, 0]) > 0.13
    vertices[arms, 1] = 1.33 + (vertices[arms, 1] - 1.33) / flat
    points = surface_points(vertices, body.faces)
    plan = plan_by_shape(vertices, body.faces, body.tree, mirror_planes(points, 4))
    return replace(character_of(body), vertices=vertices, plan=plan)


@pytest.fixture(scope="module")
def angel() -> Character:
    return winged(8.0)


@pytest.fixture(scope="module")
def driver(angel: Character) -> BodyDriver:
    return BodyDriver(paired(Puppet(angel)))


def wings(driver: BodyDriver, character: Character, positions: Array) -> Array:
    """The bones (2, n, 3) of both wings, unit vectors, for a performer who stood at rest."""
    performer = Performer(BODY)
    start = performer.follow(frame(pose(), 0.0))
    driver.prepare([start], rest_state(start, heading=0.0))
    nodes = driver.targets(performer.follow(frame(positions, 0.1))).nodes
    assert nodes is not None
    assert character.plan is not None
    chains = [list(character.plan.arms[side].chain) for side in SIDES]
    bones = np.array([np.diff(nodes.positions[chain], axis=0) for chain in chains])
    return bones / np.linalg.norm(bones, axis=2, keepdims=True)


def straight_to(turn: float, rise: float, bend: float = 0.0) -> Array:
    """The performer with arms to the sides, turned to the front, raised, and bent upward [rad]."""
    positions = pose()
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        chain = [BODY.index(f"{name}{side}") for name in ("Shoulder", "Elbow", "Wrist", "Hand")]
        lengths = np.linalg.norm(np.diff(BODY.rest_positions[chain], axis=0), axis=1)
        for number, up in enumerate((rise, rise + bend, rise + bend)):
            level = np.cos(up)
            way = np.array([sign * level * np.cos(turn), np.sin(up), level * np.sin(turn)])
            positions[chain[number + 1]] = positions[chain[number]] + lengths[number] * way
    return positions


def test_long_flat_arms_are_wings_and_round_ones_are_arms(angel: Character) -> None:
    assert angel.plan is not None
    assert angel.plan.arm_word == "wing"
    round_ones = winged(1.0).plan
    assert round_ones is not None
    assert round_ones.arm_word == "arm"


def test_the_limbs_of_a_sheet_are_no_wings(angel: Character) -> None:
    assert angel.plan is not None
    points = surface_points(angel.vertices, angel.faces)
    assert are_wings(points, angel.skeleton.tree, angel.plan)
    assert not are_wings(points * (1.0, 1.0, 0.001), angel.skeleton.tree, angel.plan)


def test_they_are_called_wings(driver: BodyDriver) -> None:
    assert "left arm -> left wing, absolute, 100 %" in [str(part) for part in driver.parts]


@given(rise=st.floats(0.0, 0.7))
def test_straight_wings_rise_as_the_arms(driver, angel, rise: float) -> None:
    whole = wings(driver, angel, straight_to(0.0, rise))[0].mean(axis=0)
    assert np.arctan2(whole[1], whole[0]) == pytest.approx(rise, abs=0.03)


@given(turn=st.floats(-0.5, 2.5), rise=st.floats(-1.2, 1.5), bend=st.floats(-1.0, 2.6))
def test_a_bend_is_spread_over_the_wing_and_limited(driver, angel, turn, rise, bend) -> None:
    for bones in wings(driver, angel, straight_to(turn, rise, bend)):
        steps = np.arccos(np.clip((bones[1:] * bones[:-1]).sum(axis=1), -1.0, 1.0))
        assert steps.max() < NO_STEP
        assert np.arccos(np.clip(bones[0] @ bones[-1], -1.0, 1.0)) < np.radians(70.0)


def test_a_bent_arm_bends_the_wing_upward(driver, angel) -> None:
    bones = wings(driver, angel, straight_to(0.0, 0.0, np.pi / 2.0))[0]
    assert abs(np.arcsin(bones[0, 1])) < 0.1
    assert np.arcsin(bones[-1, 1]) > np.radians(45.0)
    assert (np.diff(bones[:, 1]) > -1e-9).all()


def test_arms_to_the_front_and_overhead_do_not_close_the_wings(driver, angel) -> None:
    for positions in (straight_to(np.pi / 2.0, 0.0), straight_to(0.0, np.pi / 2.0)):
        left, right = wings(driver, angel, positions)
        assert left[:, 0].min() > np.cos(np.radians(76.0))
        np.testing.assert_allclose(right, left * (-1.0, 1.0, 1.0), atol=0.02)
