"""A snake stands up before its performer, bows, sways and sinks with them, and goes along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from runtime.characters.character import Character
from runtime.characters.creatures.limbless import plan_of_limbless
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.performer import Performer, rest_state
from runtime.puppet.puppet import Puppet
from tests.runtime.capsule_bodies import capsule_body, character_of
from tests.runtime.stick_figures import BODY, frame, paired, pose

SNAKE = {
    "spine": ("", [(0, 0.05, -1.0), (0, 0.05, 0.8)], 0.04),
    "head": ("spine", [(0, 0.05, 1.0)], 0.06),
}
HANGING = {"ShoulderLeft": (0.0, 0.0, -1.4), "ShoulderRight": (0.0, 0.0, 1.4)}
UP = {"ShoulderLeft": (0.0, 0.0, 1.4), "ShoulderRight": (0.0, 0.0, -1.4)}
ASIDE = {"ShoulderRight": (0.0, 0.0, 1.4)}  # the left hand reaches out to the left
SQUAT = {
    "HipLeft": (-1.3, 0.0, 0.0),
    "HipRight": (-1.3, 0.0, 0.0),
    "KneeLeft": (2.4, 0.0, 0.0),
    "KneeRight": (2.4, 0.0, 0.0),
}


def snake() -> Character:
    body = capsule_body(SNAKE)
    plan = plan_of_limbless(body.vertices, body.faces, body.tree)
    return replace(character_of(body), plan=plan)


def chests(*poses: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The chest (frames, 3) and the hips of a snake on the stage, for poses of its performer."""
    character = snake()
    assert character.plan is not None
    puppet = Puppet(character)
    driver = BodyDriver(paired(puppet))
    performer = Performer(BODY)
    start = performer.follow(frame(pose(HANGING), 0.0))
    driver.prepare([start], rest_state(start, heading=0.0))
    puppet.drive_with(driver)
    found = []
    for number, positions in enumerate(poses):
        puppet.follow(performer.follow(frame(positions, number / 30.0)))
        nodes = puppet.deform().nodes
        assert nodes is not None
        found.append(nodes.positions[[character.plan.trunk[-1], character.plan.hips]])
    both = np.array(found)
    return both[:, 0], both[:, 1]


def test_it_stands_up_before_who_stands() -> None:
    chest, hips = chests(pose(HANGING))
    assert chest[0, 1] - hips[0, 1] > 0.25


def test_it_stretches_when_both_arms_go_up() -> None:
    chest, _ = chests(pose(HANGING), pose(UP))
    assert chest[1, 1] > chest[0, 1] + 0.1
    assert chest[1, 0] == pytest.approx(0.0, abs=0.02)


def test_it_sways_to_the_side_of_a_hand() -> None:
    chest, _ = chests(pose(HANGING), pose(ASIDE))
    assert chest[1, 0] > chest[0, 0] + 0.1


def test_it_sinks_with_who_crouches() -> None:
    chest, _ = chests(pose(HANGING), pose({**HANGING, **SQUAT}))
    assert chest[1, 1] < chest[0, 1] - 0.1


def test_it_goes_where_its_performer_goes() -> None:
    step = np.array([0.4, 0.0, 0.8])
    _, hips = chests(pose(HANGING), pose(HANGING) + step)
    way = hips[1] - hips[0]
    assert way[2] > 0.2
    assert way[0] == pytest.approx(way[2] / 2.0, abs=0.02)
