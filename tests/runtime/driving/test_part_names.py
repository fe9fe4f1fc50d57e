"""Parts of bodies have names that people understand, also where a rig has none."""

from __future__ import annotations

import numpy as np
import pytest

from devices.bodies.body_plan import BodyPlan, Limb
from devices.bodies.joint_names import Side
from devices.skeleton import Skeleton
from runtime.driving.part_names import part_name

NAMES = (
    "root",
    "tentacle1.0",
    "tentacle1.9",
    "tentacle2.9",
    "tentacle3.9",
    "mantle7",
    "node51",
    "node52",
)
PLACES = (
    (0, 0, 0),
    (0, 0, 0),
    (1, 1, 0),
    (-1, -1, 0),
    (0, 0, 0),
    (0, 1, 0),
    (-1, 0, 1),
    (0, 0, -1),
)
SQUID = Skeleton(NAMES, np.array([-1, 0, 1, 0, 0, 0, 0, 0]), np.array(PLACES, dtype=float))


@pytest.mark.parametrize(
    ("tip", "words"),
    [
        ("tentacle1.9", "tentacle 1 of 3, upper left"),
        ("tentacle2.9", "tentacle 2 of 3, lower right"),
        ("tentacle3.9", "tentacle 3 of 3"),
        ("mantle7", "mantle"),
        ("node51", "limb, front right"),
        ("node52", "limb, rear"),
        ("root", "root"),
    ],
)
def test_a_part_without_a_plan_is_counted_or_called_by_its_place(tip: str, words: str) -> None:
    assert part_name(SQUID, None, (0, NAMES.index(tip))) == words


def test_a_chain_that_goes_on_beyond_a_limb_is_called_by_that_limb() -> None:
    names = ("hips", "RightArm", "RightHand", "RFingers_end", "Horn_end")
    body = Skeleton(names, np.array([-1, 0, 1, 2, 0]), np.zeros((5, 3)))
    plan = BodyPlan((0,), arms={Side.RIGHT: Limb((1, 2))})
    assert part_name(body, plan, (1, 2, 3)) == "right arm"
    assert part_name(body, plan, (0, 4)) == "Horn_end"
