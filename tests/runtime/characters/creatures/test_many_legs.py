"""Bodies of more than four legs: which pair is in front, which behind, and where they look."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.body_plan import SIDES, BodyPlan
from devices.bodies.joint_names import Side
from runtime.characters.creatures.many_legs import plan_of_many_legs
from runtime.characters.open_character import load_character
from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_plane import mirror_planes
from tests.runtime.capsule_bodies import DOG, PERSON, SPIDER, CapsuleBody, both, capsule_body
from tests.thorough import combined

ABDOMEN = {"abdomen": ("hips", [(0, 0.32, -0.3), (0, 0.35, -0.7)], 0.18)}
FEELERS = both("feeler", "trunk", [(0.1, 0.4, 0.35), (0.2, 0.5, 0.6)], 0.015)
ANT = {
    "trunk": ("", [(0, 0.3, -0.15), (0, 0.3, 0.15)], 0.07),
    "head": ("trunk", [(0, 0.33, 0.25), (0, 0.33, 0.4)], 0.08),
    **ABDOMEN,
    **both("feeler", "head", [(0.1, 0.45, 0.5), (0.25, 0.5, 0.7)], 0.012),
    **both("leg2", "trunk", [(0.2, 0.42, 0.3), (0.4, 0.01, 0.5)], 0.02),
    **both("leg1", "trunk:0.5", [(0.25, 0.42, 0.0), (0.5, 0.01, 0.0)], 0.02),
    **both("leg0", "hips", [(0.2, 0.42, -0.3), (0.45, 0.01, -0.55)], 0.02),
}


def planned(body: CapsuleBody) -> BodyPlan | None:
    planes = mirror_planes(surface_points(body.vertices, body.faces), 4)
    return plan_of_many_legs(body.vertices, body.faces, body.tree, planes)


def legs_of(body: CapsuleBody, plan: BodyPlan, side: Side) -> list[set[str]]:
    """The branches of the legs of one side, from the front to the hind."""
    pairs = (plan.arms, *plan.more_legs, plan.legs)
    return [body.names(pair[side].chain) for pair in pairs]


BODIES = {
    "abdomen": ({**SPIDER, **ABDOMEN}, 4),
    "feelers": ({**SPIDER, **FEELERS}, 4),
    "ant": (ANT, 3),
}


@pytest.mark.parametrize(("name", "yaw"), combined(list(BODIES), [0, 40, 90, 200]))
def test_legs_are_paired_from_the_front_to_the_hind(name: str, yaw: float) -> None:
    branches, pairs = BODIES[name]
    turn = Rotation.from_euler("y", yaw, degrees=True).as_matrix()
    body = capsule_body(branches).moved(turn, np.array([1.0, 0.2, -3.0]))
    plan = planned(body)
    assert plan is not None
    for side, letter in zip(SIDES, "LR", strict=True):
        assert legs_of(body, plan, side) == [
            {f"leg{number}.{letter}"} for number in reversed(range(pairs))
        ]
    if branches is ANT:
        assert body.names(plan.head) == {"head"}
        assert body.names(plan.tail) == {"abdomen"}


def test_four_legs_or_two_are_not_many() -> None:
    assert planned(capsule_body(DOG)) is None
    assert planned(capsule_body(PERSON)) is None


def test_every_leg_is_divided_at_its_knee_and_beside_the_trunk() -> None:
    body = capsule_body({**SPIDER, **ABDOMEN})
    plan = planned(body)
    assert plan is not None
    places = body.tree.positions
    for pair in (plan.arms, *plan.more_legs, plan.legs):
        for limb in pair.values():
            assert abs(places[limb.upper[0], 0]) > 0.02
            assert places[limb.lower[0], 1] == pytest.approx(0.5, abs=0.1)
            assert places[limb.lower[-1], 1] == pytest.approx(0.02, abs=0.01)


@pytest.mark.parametrize(
    "name", ["m2m_model-spider.glb", "m2m_rig-spider.glb", "m2m_spider-animations.glb"]
)
def test_real_spiders_look_at_the_audience(shared: Path, name: str) -> None:
    character = load_character(shared / "rig" / name)
    plan, places = character.plan, character.skeleton.rest_positions
    assert plan is not None
    assert len(plan.more_legs) == 2
    pairs = (plan.arms, *plan.more_legs, plan.legs)
    feet = np.array([[places[pair[side].chain[-1]] for pair in pairs] for side in SIDES])
    assert (feet[0, :, 0] > 0.3).all()
    assert (feet[1, :, 0] < -0.3).all()
    assert (np.diff(feet[:, :, 2]) < 0.0).all()
    assert places[plan.tail[-1], 2] < feet[:, :, 2].mean()
    starts = [limb.upper[0] for pair in pairs for limb in pair.values()]
    chains = [set(limb.chain) for pair in pairs for limb in pair.values()]
    assert all(sum(start in chain for chain in chains) == 1 for start in starts)
