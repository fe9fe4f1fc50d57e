"""A spider steps as its performer steps, and lifts its front legs as the arms are lifted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan
from runtime.characters.character import Character
from runtime.characters.creatures.many_legs import plan_of_many_legs
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.drivers import best_driver
from runtime.driving.performer import Performer, rest_state
from runtime.driving.root_motion import chain_length
from runtime.puppet.puppet import Puppet
from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_plane import mirror_planes
from tests.runtime.capsule_bodies import SPIDER, capsule_body, character_of
from tests.runtime.stick_figures import BODY, frame, paired, pose

HANGING = {"ShoulderLeft": (0.0, 0.0, -0.75), "ShoulderRight": (0.0, 0.0, 0.75)}


def spider() -> Character:
    """A spider with an abdomen behind it."""
    body = capsule_body({**SPIDER, "abdomen": ("hips", [(0, 0.3, -0.3), (0, 0.3, -0.7)], 0.12)})
    planes = mirror_planes(surface_points(body.vertices, body.faces), 4)
    plan = plan_of_many_legs(body.vertices, body.faces, body.tree, planes)
    return replace(character_of(body), plan=plan)


def plan_of(character: Character) -> BodyPlan:
    assert character.plan is not None
    return character.plan


def feet(character: Character, *poses: NDArray[np.float64]) -> tuple[Puppet, NDArray[np.float64]]:
    """The puppet, and its feet (frames, 2, pairs, 3) on the stage, from the front to the hind."""
    plan = plan_of(character)
    puppet = Puppet(character)
    driver = BodyDriver(paired(puppet))
    performer = Performer(BODY)
    start = performer.follow(frame(pose(HANGING), 0.0))
    driver.prepare([start], rest_state(start, heading=0.0))
    puppet.drive_with(driver)
    pairs = (plan.arms, *plan.more_legs, plan.legs)
    found = []
    for number, positions in enumerate(poses):
        puppet.follow(performer.follow(frame(positions, number / 30.0)))
        nodes = puppet.deform().nodes
        assert nodes is not None
        places = nodes.positions
        found.append([[places[pair[side].chain[-1]] for pair in pairs] for side in SIDES])
    return puppet, np.array(found)


@pytest.fixture(scope="module")
def character() -> Character:
    return spider()


def test_a_spider_is_driven_limb_by_limb(character: Character) -> None:
    driver = best_driver(paired(Puppet(character)))
    assert isinstance(driver, BodyDriver)
    words = [str(part) for part in driver.parts]
    assert "left arm -> left front leg, relative, 100 %" in words
    assert "right leg -> right hind leg, relative, 100 %" in words
    assert "left leg -> left leg 2, relative, 100 %" in words


def test_who_stands_lets_it_stand_as_at_rest(character: Character) -> None:
    _, found = feet(character, pose(HANGING))
    plan, rest = plan_of(character), character.skeleton.rest_positions
    pairs = (plan.arms, *plan.more_legs, plan.legs)
    at_rest = np.array([[rest[pair[side].chain[-1]] for pair in pairs] for side in SIDES])
    assert found[0] == pytest.approx(at_rest, abs=0.03)


def test_lifted_arms_lift_the_front_legs_alone(character: Character) -> None:
    lifted = {"ShoulderLeft": (0.0, 0.0, 1.6), "ShoulderRight": (0.0, 0.0, -1.6)}
    puppet, found = feet(character, pose(HANGING), pose(lifted))
    rise = found[1, :, :, 1] - found[0, :, :, 1]
    assert (rise[:, 0] > 0.4).all()
    assert np.abs(rise[:, 1:]).max() < 0.01
    hips = character.skeleton.rest_positions[plan_of(character).hips]
    assert puppet.deform().nodes.positions[plan_of(character).hips] == pytest.approx(hips, abs=0.02)


def test_legs_beside_each_other_step_in_turn(character: Character) -> None:
    step = {**HANGING, "HipLeft": (-0.5, 0.0, 0.0), "HipRight": (0.5, 0.0, 0.0)}
    _, found = feet(character, pose(HANGING), pose(step))
    ahead = found[1, :, :, 2] - found[0, :, :, 2]
    signs = np.sign(ahead).astype(int)
    assert signs[0].tolist() == [-1, 1, -1, 1]
    assert signs[1].tolist() == [1, -1, 1, -1]
    assert np.abs(ahead) == pytest.approx(np.abs(ahead).mean(), rel=0.1)


def test_legs_spread_with_the_performers_to_their_own_side(character: Character) -> None:
    spread = {**HANGING, "HipLeft": (0.0, 0.0, 0.4), "HipRight": (0.0, 0.0, -0.4)}
    _, found = feet(character, pose(HANGING), pose(spread))
    out = found[1, :, :, 0] - found[0, :, :, 0]
    assert (out[0] > 0.05).all()
    assert (out[1] < -0.05).all()


def test_a_planted_foot_stays_while_the_hips_travel(character: Character) -> None:
    _, found = feet(
        character,
        pose(HANGING),
        pose({**HANGING, "HipLeft": (0.2, 0.0, 0.0)}, moved=(0.0, 0.0, 0.1)),
    )
    leg = chain_length(
        BODY.rest_positions, [BODY.index(f"{name}Left") for name in ("Hip", "Knee", "Ankle")]
    )
    slide = leg * np.sin(0.2) - 0.1  # of the performer's own foot [m]
    moved = found[1, 0, 3, 2] - found[0, 0, 3, 2]
    stride = float(np.median(np.linalg.norm(np.diff(found[0, 0], axis=0), axis=1)))
    assert moved == pytest.approx(-slide * stride / leg, abs=0.02)


def test_no_bow_pushes_it_through_the_floor(character: Character) -> None:
    bow = {**HANGING, "SpineMid": (1.2, 0.0, 0.0)}
    puppet, found = feet(character, pose(HANGING), pose(bow))
    assert puppet.deform().vertices[:, 1].min() == pytest.approx(0.0, abs=0.01)
    assert np.abs(found[1, :, 1:, 1] - found[0, :, 1:, 1]).max() < 0.03
