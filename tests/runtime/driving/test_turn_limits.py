"""A limb turns as far as its surface can follow, and no other is held back for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from runtime.characters.character import Character
from runtime.driving.driver import StretchLimits
from runtime.driving.mapping import Drive
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.driving.polyline_driver import PolylineDriver
from runtime.driving.turn_limits import limit_turns
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    WEB,
    driven_by,
    frame,
    make_figure,
    node,
    pose,
    seen,
    waving,
)

BETWEEN_ARM_AND_HEAD = ((0.16, 1.28, -0.08), (0.64, 1.6, 0.08))
FIGURE = make_figure()
HEAD = Drive(
    tuple(map(BODY.index, ("SpineShoulder", "Neck", "Head"))), tuple(map(node, ("chest", "head")))
)


def driven(character: Character, drives: Sequence[Drive]) -> tuple[Puppet, PolylineDriver]:
    puppet = Puppet(character)
    return puppet, driven_by(puppet, drives, rest_state(seen(pose())))


def stretch_of(puppet: Puppet, moment: Pose) -> np.ndarray:
    puppet.attempt(moment)
    return puppet.surface.stretch


def nods(*angles: float) -> list[Pose]:
    return [seen(pose({"SpineShoulder": (angle, 0.0, 0.0)})) for angle in angles]


def test_only_the_limb_that_cannot_follow_is_held_back() -> None:
    swings = [
        seen(pose({"ShoulderLeft": (0, 0, angle), "ShoulderRight": (0, 0, -angle)}))
        for angle in (0.0, 0.5, 0.9, 1.3)
    ]
    free, driver = driven(FIGURE, ARMS)
    box = limit_turns(free, driver, swings)
    np.testing.assert_array_equal(driver.gains, [1.0, 1.0])
    webbed, held = driven(make_figure(WEB), ARMS)
    limit_turns(webbed, held, swings)
    assert held.gains[0] < 0.95
    assert held.gains[1] == 1.0

    assert box.shape == (2, 3)
    for moment in swings:
        free.follow(moment)
        for _ in range(4):
            vertices = free.deform().vertices
        assert (vertices >= box[0] - 0.05).all()
        assert (vertices <= box[1] + 0.05).all()
    assert box[0, 0] > -0.9, "an arm that is raised reaches less far to the side"
    assert box[1, 1] > 1.7, "but higher"


@pytest.mark.parametrize(("deepest", "held"), [(0.5, False), (2.2, True)])
def test_a_small_limb_that_crushes_itself_is_held_back(deepest: float, held: bool) -> None:
    """In one pose of many, and with so few edges that the whole surface hardly tells."""
    puppet, driver = driven(FIGURE, (HEAD, *ARMS))
    edges = driver.pulls()[:, 0]
    poses = nods(*[0.0] * 9, deepest)
    unheld = stretch_of(puppet, poses[-1])
    assert (
        np.percentile(np.append(np.zeros(9 * len(unheld)), unheld), 99.0) < StretchLimits().of_all
    )
    limit_turns(puppet, driver, poses)
    assert (driver.gains[0] < 1.0) == held
    np.testing.assert_array_equal(driver.gains[1:], 1.0)
    assert (
        np.percentile(stretch_of(puppet, poses[-1])[edges], 95.0) <= 1.1 * StretchLimits().of_limb
    )


def test_a_limb_that_another_crushes_is_left_alone() -> None:
    puppet, driver = driven(make_figure(BETWEEN_ARM_AND_HEAD), (HEAD, *ARMS))
    raised = [seen(pose({"ShoulderLeft": (0, 0, angle)})) for angle in [0.0] * 29 + [1.4]]
    limit_turns(puppet, driver, raised)
    assert driver.gains[0] == 1.0
    assert driver.gains[1] < 0.95


def test_a_rehearsal_leaves_no_trace_in_the_show() -> None:
    shown = []
    for rehearsals in (0, 1):
        (puppet, driver), performer = driven(FIGURE, ARMS), Performer(BODY)
        for _ in range(rehearsals):
            limit_turns(puppet, driver, [seen(positions) for positions in waving(4)])
        for number, positions in enumerate(waving(4)):
            puppet.follow(performer.follow(frame(positions, number / 30.0)))
            motion = puppet.deform()
        shown.append(motion.vertices)
    np.testing.assert_array_equal(*shown)
