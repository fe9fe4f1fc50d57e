"""Bodies without names: which limbs are legs, arms, head and tail, by their shape alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.body_plan import SIDES, BodyPlan
from devices.bodies.joint_names import Side
from devices.bodies.rest_heading import rest_heading
from devices.skeleton import Skeleton
from runtime.characters.open_character import load_character
from tests.runtime.capsule_bodies import (
    DOG,
    MOUSE,
    PERSON,
    SPIDER,
    CapsuleBody,
    both,
    capsule_body,
    plan_of,
)
from tests.thorough import combined, third_of

BODIES = {"person": PERSON, "mouse": MOUSE, "dog": DOG}
MIRROR = np.diag([-1.0, 1.0, 1.0])


def heading(body: CapsuleBody, plan: BodyPlan) -> float:
    names = tuple(f"node{index}" for index in range(len(body.tree)))
    skeleton = Skeleton(names, body.tree.parents, body.tree.positions)
    return float(np.degrees(rest_heading(skeleton, plan)))


def turn(degrees: float) -> np.ndarray:
    return Rotation.from_euler("y", degrees, degrees=True).as_matrix()


def assert_roles(body: CapsuleBody, plan: BodyPlan | None, left: str = "L") -> None:
    """Each part of the plan lies on the branch of its name."""
    assert plan is not None
    letters = dict(zip(SIDES, "LR" if left == "L" else "RL", strict=True))
    for name, limbs in (("arm", plan.arms), ("leg", plan.legs)):
        for side in SIDES:
            assert body.names(limbs[side].segments[0]) == {f"{name}.{letters[side]}"}
            assert body.names(limbs[side].segments[-1]) == {f"{name}.{letters[side]}"}
    assert body.names(plan.head) == {"head"}
    assert body.names(plan.trunk) == {"trunk"}
    assert body.names(plan.tail) <= {"tail"}


@pytest.mark.parametrize(("name", "yaw"), combined(list(BODIES), [0, 37, 90, 180, 250]))
def test_a_body_has_the_same_roles_whichever_way_it_is_turned(name: str, yaw: float) -> None:
    branches = BODIES[name]
    body = capsule_body(branches).moved(turn(yaw), np.array([3.0, 0.5, -2.0]))
    plan = plan_of(body)
    assert_roles(body, plan)
    assert bool(plan.tail) == ("tail" in branches)
    assert plan.arm_word == ("foreleg" if branches is DOG else "arm")
    assert abs((heading(body, plan) - yaw + 180) % 360 - 180) < 3.0


@pytest.mark.parametrize("branches", [MOUSE, DOG], ids=["mouse", "dog"])
def test_left_and_right_swap_in_the_mirror(branches) -> None:
    body = capsule_body(branches).moved(MIRROR)
    plan = plan_of(body)
    assert_roles(body, plan, left="R")
    assert abs(heading(body, plan)) < 3.0


def test_ears_are_no_arms() -> None:
    body = capsule_body({**PERSON, **both("ear", "head", [(0.2, 1.8, 0), (0.6, 1.9, 0)], 0.04)})
    assert_roles(body, plan_of(body))


def test_a_raised_tail_is_no_head() -> None:
    branches = {**DOG, "tail": ("hips", [(0, 0.8, -0.5), (0, 1.2, -0.5)], 0.03)}
    body = capsule_body(branches)
    assert_roles(body, plan_of(body))


def test_the_legs_of_an_animal_that_leaps_are_legs() -> None:
    leap = {
        **DOG,
        **both("leg", "hips", [(0.12, 0.5, -0.5), (0.12, 0.3, -0.75), (0.12, 0.25, -0.95)], 0.04),
        **both("arm", "trunk", [(0.12, 0.5, 0.5), (0.12, 0.25, 0.7), (0.12, 0.25, 0.95)], 0.04),
    }
    places = [(-0.12, 0.5, 0.5), (-0.12, 0.2, 0.7), (-0.12, 0.02, 0.85)]
    body = capsule_body({**leap, "arm.R": ("trunk", places, 0.04)})
    plan = plan_of(body)
    assert_roles(body, plan)
    assert plan.arm_word == "foreleg"


def test_legs_in_mid_step_are_a_pair() -> None:
    step = {
        f"leg.{side}": (
            "hips",
            [(x, 0.85, 0), (x, 0.45, z), (x, 0.04, z), (x, 0.02, z + 0.15)],
            0.05,
        )
        for side, x, z in (("L", 0.11, 0.25), ("R", -0.11, -0.25))
    }
    body = capsule_body({**PERSON, **step})
    assert_roles(body, plan_of(body))


def test_fingers_belong_to_their_arm() -> None:
    fingers = {
        f"{name}.{side}": (f"arm.{side}", [(sign * x, y, 0.1)], 0.012)
        for side, sign in (("L", 1), ("R", -1))
        for name, x, y in (("thumb", 0.62, 0.9), ("index", 0.7, 0.85), ("little", 0.72, 0.92))
    }
    body = capsule_body({**PERSON, **fingers})
    plan = plan_of(body)
    assert plan is not None
    for side, letter in zip(SIDES, "LR", strict=True):
        assert body.names(plan.arms[side].upper) == {f"arm.{letter}"}
        assert body.names(plan.arms[side].segments[-1]) <= set(fingers) | {f"arm.{letter}"}


def test_more_than_four_legs_have_no_plan() -> None:
    assert plan_of(capsule_body(SPIDER)) is None


def test_a_body_that_is_no_mirror_image_has_no_plan() -> None:
    lopsided = dict(PERSON)
    lopsided["arm.R"] = ("trunk", [(-0.1, 1.4, 0.8), (-0.1, 1.4, 1.6)], 0.15)
    lopsided["leg.R"] = ("hips", [(-0.1, 0.8, -0.5), (-0.1, 0.75, -1.2)], 0.15)
    assert plan_of(capsule_body(lopsided)) is None


def test_limbs_begin_outside_the_trunk_and_both_alike() -> None:
    body = capsule_body(MOUSE)
    plan = plan_of(body)
    assert plan is not None
    for limbs in (plan.arms, plan.legs):
        left, right = (body.tree.positions[limbs[side].upper[0]] for side in SIDES)
        assert left[0] > 0.02
        assert left == pytest.approx(MIRROR @ right, abs=0.01)


# What the pictures of these meshes show: legs, arms, tail, and the heading at rest in degrees.
SEEN = {
    "mesh/camel_b.obj": (True, True, True, 90),
    "mesh/cat_dt/cat_reference.obj": (True, True, True, 90),
    "mesh/cat_dt/cat_000001.obj": (True, True, True, 90),
    "mesh/cat_dt/cat_000011.obj": (True, True, True, 90),
    "mesh/cat_dt/dog_reference.obj": (True, True, True, 90),
    "mesh/cow.off": (True, True, True, 90),
    "mesh/cgal_armadillo.off": (True, True, True, 0),
    "mesh/cgal_dino.off": (True, True, True, 0),
    "mesh/cgal_man.off": (True, True, False, -20),
    "mesh/decimated-knight.off": (True, True, False, 0),
    "mesh/elephant.obj": (True, True, False, 0),
    "mesh/teddy.obj": (True, True, False, 0),
    "mesh/woody_planar.obj": (True, True, False, 0),
    "rig/m2m_model-bird.glb": (True, True, True, 0),
    "rig/m2m_model-fox.glb": (True, True, True, 90),
    "rig/m2m_model-human.glb": (True, True, False, 0),
    "human/anny_fat_male_rest.obj": (True, True, False, 0),
}
UNKNOWN = [
    "mesh/arm.obj",
    "mesh/octopus-low.mesh",
    "mesh/bad/teapot.obj",
]


@pytest.mark.parametrize("name", third_of(SEEN))
def test_real_bodies_have_the_roles_that_one_sees(shared: Path, name: str) -> None:
    character = load_character(shared / name)
    plan, places = character.plan, character.skeleton.rest_positions
    legs, arms, tail, facing = SEEN[name]
    assert plan is not None
    assert (len(plan.legs) == 2, len(plan.arms) == 2, bool(plan.tail)) == (legs, arms, tail)
    at_rest = rest_heading(character.skeleton, plan)
    assert np.degrees(at_rest) == pytest.approx(facing, abs=10)
    left = np.array([np.cos(at_rest), 0.0, -np.sin(at_rest)])
    height = np.ptp(character.vertices[:, 1])
    for limbs in (plan.arms, plan.legs):
        near, far = (places[list(limbs[side].upper)].mean(axis=0) for side in SIDES)
        assert (near - far) @ left > 0.0
    for side in SIDES:
        assert places[plan.legs[side].segments[-1][-1], 1] < 0.3 * height
    head = places[plan.head[-1]]
    assert head[1] > 0.4 * height
    ahead = np.array([np.sin(at_rest), 0.0, np.cos(at_rest)])
    if plan.tail:
        assert (head - places[plan.tail[-1]]) @ ahead > 0.2 * height
    assert plan.arms[Side.LEFT].upper[0] not in plan.trunk


@pytest.mark.parametrize("name", third_of(UNKNOWN))
def test_things_without_a_clear_body_have_no_plan(shared: Path, name: str) -> None:
    assert load_character(shared / name).plan is None
