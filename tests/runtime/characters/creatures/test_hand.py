"""A hand is known by its shape: five like fingers spread away from an arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from devices.bodies.joint_names import Kind, Side
from devices.skeleton import Skeleton
from runtime.characters.creatures.hand import hand_by_shape, hand_of
from solvers.skeleton.tree import Tree
from tests.runtime.stick_figures import make_figure

LITTLE_TO_THUMB = (-35.0, -12.0, 4.0, 20.0, 55.0)  # [degrees] from straight on
LENGTHS = (0.7, 0.9, 1.0, 0.9, 0.8)


def hand(angles: Sequence[float] = LITTLE_TO_THUMB, arm: float = 2.0) -> Tree:
    """An arm along +X whose fingers are turned by these angles about +Z, two bones each."""
    parents, places = [-1, 0], [np.array([-arm, 0.0, 0.0]), np.zeros(3)]
    for angle, length in zip(np.radians(angles), LENGTHS, strict=False):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        parents += [1, len(parents)]
        places += [0.5 * length * way, length * way]
    return Tree(np.array(parents), np.array(places))


@pytest.mark.parametrize("root", [0, 1, 11])
def test_five_fingers_on_an_arm_are_a_hand(root: int) -> None:
    plan = hand_by_shape(hand().rerooted(root))
    assert plan is not None
    assert plan.side is Side.CENTRE
    assert plan.arm == (0, 1)
    tips = {kind: chain[-1] for kind, chain in plan.fingers.items()}
    assert tips[Kind.LITTLE] == 3
    assert tips[Kind.INDEX] == 9
    assert tips[Kind.THUMB] == 11
    assert all(chain[0] == plan.palm for chain in plan.fingers.values())


@pytest.mark.parametrize(
    "angles",
    [(-35.0, -12.0, 4.0, 20.0), (-144.0, -72.0, 0.0, 72.0, 144.0)],
    ids=["four fingers", "a star"],
)
def test_other_branches_are_none(angles: tuple[float, ...]) -> None:
    assert hand_by_shape(hand(angles)) is None


def test_a_body_is_no_hand_whatever_its_fingers() -> None:
    assert hand_of(make_figure()) is None
    tree = hand()
    names = tuple(f"n{node}" for node in range(len(tree)))
    rig = replace(make_figure(), skeleton=Skeleton(names, tree.parents, tree.positions))
    assert hand_of(rig) is not None
