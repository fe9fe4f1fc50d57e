"""Which pairs of legs turn from where they stand, and which point as the performer's do."""

from __future__ import annotations

import numpy as np
import pytest

from devices.bodies.body_plan import Limb
from runtime.driving.body.rig_builder import RigBuilder
from runtime.driving.driver import ABSOLUTE, RELATIVE
from solvers.skeleton.tree import Tree

LEANS = float(np.cos(np.radians(35.0)))
TOP = (0.0, 1.5, 0.0)
STRAIGHT = [(0, 0.8, 0), (0, 0.4, 0.02), (0, 0, 0)]
DIGITIGRADE = [(0, 0.8, 0), (0, 0.5, 0.35), (0, 0.05, -0.05)]
SITTING = [(0, 0.2, 0), (0, 0.15, 0.3), (0, 0.1, 0.6)]
LIFTED = [(0, 0.8, 0), (0, 0.7, 0.4), (0, 0.4, 0.2)]


@pytest.mark.parametrize(
    ("leg", "drive"),
    [(STRAIGHT, ABSOLUTE), (DIGITIGRADE, RELATIVE), (SITTING, ABSOLUTE), (LIFTED, ABSOLUTE)],
    ids=["straight", "digitigrade", "sitting", "lifted"],
)
def test_legs_turn_from_rest_only_if_they_stand_and_bend(leg, drive: str) -> None:
    floor = (0.5, 0.0, 0.0)
    places = np.array([TOP, *leg, floor])
    rig = RigBuilder(Tree(np.array([-1, 0, 1, 2, 0]), places), places, 0.0)
    assert rig.drive_of([Limb((1, 2), (2, 3))], LEANS) == drive


def test_the_legs_of_an_animal_that_leaps_point_although_one_is_low() -> None:
    low = [(0.1, 0.4, 0), (0.1, 0.2, 0.15), (0.1, 0.0, 0.35)]
    ahead = [(-0.1, 0.4, 0), (-0.1, 0.3, 0.3), (-0.1, 0.3, 0.6)]
    places = np.array([TOP, *low, *ahead])
    rig = RigBuilder(Tree(np.array([-1, 0, 1, 2, 0, 4, 5]), places), places, 0.0)
    legs = [Limb((1, 2), (2, 3)), Limb((4, 5), (5, 6))]
    assert rig.drive_of(legs[:1], LEANS) == RELATIVE
    assert rig.drive_of(legs, LEANS) == ABSOLUTE
