"""Bodies of one line: where their head is, that they lie or stand, and what limbs rule out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.body_plan import BodyPlan
from devices.bodies.rest_heading import rest_heading
from devices.skeleton import Skeleton
from runtime.characters.creatures.limbless import plan_of_limbless
from runtime.characters.open_character import load_character
from tests.runtime.capsule_bodies import DOG, PERSON, SPIDER, CapsuleBody, capsule_body

SNAKE = {
    "spine": ("", [(0, 0.05, -1.0), (0.1, 0.05, 0.0), (0, 0.05, 0.8)], 0.04),
    "head": ("spine", [(0, 0.05, 1.0)], 0.06),
}
TONGUES = {
    "spine": ("", [(0, 0.05, -1.0), (0, 0.05, 1.0)], 0.04),
    "upper": ("spine", [(0, 0.07, 1.08)], 0.03),
    "lower": ("spine", [(0, 0.03, 1.06)], 0.03),
}
BOTTLE = {"bottle": ("", [(0, 0.0, 0), (0, 1.5, 0)], 0.15)}


def planned(body: CapsuleBody) -> BodyPlan | None:
    return plan_of_limbless(body.vertices, body.faces, body.tree)


def heading(body: CapsuleBody, plan: BodyPlan) -> float:
    names = tuple(str(node) for node in range(len(body.tree)))
    return rest_heading(Skeleton(names, body.tree.parents, body.tree.positions), plan)


@pytest.mark.parametrize("yaw", [0, 50, 180, 260])
@pytest.mark.parametrize("branches", [SNAKE, TONGUES], ids=["thick head", "tongues"])
def test_a_snake_looks_from_its_tail_to_its_head(branches, yaw: float) -> None:
    turn = Rotation.from_euler("y", yaw, degrees=True).as_matrix()
    body = capsule_body(branches).moved(turn, np.array([2.0, 0.0, 1.0]))
    plan = planned(body)
    assert plan is not None
    assert not plan.arms
    assert not plan.legs
    front = turn @ [0.0, 0.0, 1.0]
    places = body.tree.positions - [2.0, 0.0, 1.0]
    assert places[plan.head[-1]] @ front > 0.95
    assert places[plan.tail[-1]] @ front < -0.95
    assert plan.trunk[-1] == plan.head[0]
    assert plan.trunk[0] == plan.tail[0]
    assert np.cos(heading(body, plan) - np.radians(yaw)) > 0.99


def test_what_stands_rises_from_the_floor_and_faces_the_audience() -> None:
    body = capsule_body(BOTTLE).moved(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 1.5, 0.0]))
    plan = planned(body)
    assert plan is not None
    assert body.tree.positions[plan.hips, 1] == pytest.approx(0.0)
    assert body.tree.positions[plan.head[-1], 1] == pytest.approx(1.5)
    assert plan.tail == ()
    assert heading(body, plan) == 0.0


@pytest.mark.parametrize("branches", [DOG, PERSON, SPIDER])
def test_a_body_with_limbs_is_none(branches) -> None:
    assert planned(capsule_body(branches)) is None


def test_a_thick_body_that_lies_is_none() -> None:
    assert planned(capsule_body({"bun": ("", [(0, 0.3, -0.5), (0, 0.3, 0.5)], 0.3)})) is None


def test_the_fingers_of_an_arm_are_no_tongues() -> None:
    fingers = {
        f"finger{number}": ("spine", [(0.05 * number, 0.05, 1.1)], 0.02) for number in range(-2, 3)
    }
    assert planned(capsule_body({**SNAKE, **fingers})) is None


def test_a_real_snake_faces_the_audience(shared: Path) -> None:
    character = load_character(shared / "rig" / "m2m_model-snake.glb")
    plan, places = character.plan, character.skeleton.rest_positions
    assert plan is not None
    assert places[plan.head[-1], 2] > 1.0
    assert places[plan.tail[-1], 2] < -1.0
