"""Flat animals seen from the side: which way they look, and which leg is in front."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.bodies.body_plan import BodyPlan
from devices.bodies.joint_names import Side
from runtime.characters.creatures.profile import plan_of_profile
from runtime.characters.open_character import load_character
from tests.runtime.capsule_bodies import CapsuleBody, capsule_body

FLAT = np.diag([1.0, 1.0, 0.0])
LIZARD = {
    "spine": ("", [(1.0, 0.3, 0), (0.4, 0.3, 0), (-0.3, 0.3, 0)], 0.05),
    "hind": ("spine:0.5", [(0.35, 0.15, 0), (0.35, 0.0, 0)], 0.03),
    "head": ("spine", [(-0.9, 0.3, 0)], 0.08),
    "front": ("spine", [(-0.32, 0.15, 0), (-0.35, 0.0, 0)], 0.03),
}


def drawn(body: CapsuleBody) -> tuple[CapsuleBody, BodyPlan | None]:
    flat = body.moved(FLAT)
    return flat, plan_of_profile(flat.vertices, flat.faces, flat.tree)


@pytest.mark.parametrize("looks", [-1.0, 1.0], ids=["left", "right"])
def test_the_leg_that_is_seen_is_on_the_near_side(looks: float) -> None:
    body, plan = drawn(capsule_body(LIZARD).moved(np.diag([-looks, 1.0, 1.0])))
    assert plan is not None
    near = Side.LEFT if looks < 0.0 else Side.RIGHT
    assert list(plan.arms) == [near]
    assert list(plan.legs) == [near]
    assert body.names(plan.arms[near].chain) == {"front"}
    assert body.names(plan.legs[near].chain) == {"hind"}
    places = body.tree.positions
    assert looks * places[plan.head[-1], 0] == pytest.approx(0.9, abs=0.05)
    assert looks * places[plan.tail[-1], 0] == pytest.approx(-1.0, abs=0.05)


def test_a_body_with_depth_is_none() -> None:
    body = capsule_body(LIZARD)
    assert plan_of_profile(body.vertices, body.faces, body.tree) is None


def test_one_leg_is_no_animal() -> None:
    _, plan = drawn(capsule_body({name: LIZARD[name] for name in ("spine", "head", "hind")}))
    assert plan is None


def test_an_alligator_keeps_its_tail_and_its_jaws(shared: Path) -> None:
    character = load_character(shared / "mesh" / "alligator.obj")
    plan, places = character.plan, character.skeleton.rest_positions
    assert plan is not None
    feet = [pair[Side.LEFT].chain[-1] for pair in (plan.arms, plan.legs)]
    assert (places[feet, 1] < 0.06).all()
    assert places[plan.head[-1], 0] < -1.0
    assert places[plan.tail[-1], 0] > 1.0
