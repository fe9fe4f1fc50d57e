"""A body that lies close to the floor bows no deeper than it has room; a tall one bows as deep."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.performer import Performer, rest_state
from runtime.puppet.puppet import Puppet
from tests.runtime.capsule_bodies import DOG, Branches, both, capsule_body, planned
from tests.runtime.stick_figures import BODY, frame, paired, pose

HANGING = {"ShoulderLeft": (0.0, 0.0, -0.75), "ShoulderRight": (0.0, 0.0, 0.75)}
BOW = {**HANGING, "SpineBase": (1.0, 0.0, 0.0), "HipLeft": (-1.0, 0.0, 0.0),
       "HipRight": (-1.0, 0.0, 0.0)}  # fmt: skip
LIZARD: Branches = {
    "trunk": ("", [(0, 0.2, -0.8), (0, 0.2, 0.8)], 0.1),
    "head": ("trunk", [(0, 0.25, 1.1), (0, 0.25, 1.3)], 0.07),
    "tail": ("hips", [(0, 0.2, -1.2), (0, 0.1, -1.8)], 0.03),
    **both("leg", "hips", [(0.2, 0.2, -0.8), (0.25, 0.12, -0.75), (0.25, 0.02, -0.8)], 0.02),
    **both("arm", "trunk", [(0.2, 0.2, 0.8), (0.25, 0.12, 0.75), (0.25, 0.02, 0.8)], 0.02),
}


def dip(branches: Branches) -> float:
    """The angle [deg] by which the trunk of a body sinks in front when its performer bows."""
    puppet = Puppet(planned(capsule_body(branches)))
    plan = puppet.character.plan
    assert plan is not None
    driver = BodyDriver(paired(puppet))
    performer = Performer(BODY)
    start = performer.follow(frame(pose(HANGING), 0.0))
    driver.prepare([start], rest_state(start, heading=0.0))
    nodes = driver.targets(performer.follow(frame(pose(BOW), 0.5))).nodes
    assert nodes is not None
    x, y, z = nodes.positions[plan.trunk[-1]] - nodes.positions[plan.hips]
    return float(-np.degrees(np.arctan2(y, np.hypot(x, z))))


@pytest.mark.parametrize(("branches", "least", "most"), [(LIZARD, 2.0, 12.0), (DOG, 15.0, 75.0)])
def test_who_lies_close_to_the_floor_bows_less(branches, least: float, most: float) -> None:
    assert least < dip(branches) < most
