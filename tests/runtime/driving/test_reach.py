"""The space that a character needs: the whole way counts, with any driver and after any trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from devices.bodies.plan_by_names import plan_by_names
from runtime.driving.body.body_driver import BodyDriver
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.driving.reach import reach_of
from runtime.driving.targets import Placement, SkinnedTargets, Targets
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import BODY, make_figure, pose, seen

FIGURE = make_figure()
BOX = np.array([FIGURE.vertices.min(axis=0), FIGURE.vertices.max(axis=0)])


class Walker:
    """A driver that takes its character along with the performer's hips, in the rest pose."""

    def __init__(self, finished: bool) -> None:
        self.finished = finished
        self.resets = 0

    def targets(self, pose: Pose) -> Targets:
        shape = FIGURE.vertices if self.finished else SkinnedTargets(FIGURE.vertices)
        return Targets(shape, Placement(pose.heading, (pose.hips[0], pose.hips[2])))

    def reset(self) -> None:
        self.resets += 1


def walk(*ways: tuple[float, float], heading: float = 0.0) -> list[Pose]:
    still = seen(pose())
    return [
        replace(
            still,
            seen=still.seen - still.hips + (x, 1.0, z),
            hips=np.array([x, 1.0, z]),
            heading=heading,
        )
        for x, z in ways
    ]


@pytest.mark.parametrize("finished", [False, True])
def test_the_whole_way_is_known_and_what_is_filled_in_place(finished: bool) -> None:
    driver = Walker(finished)
    around = BOX + np.array(
        [(-0.1, 0.0, -0.2), (0.3, 0.4, 0.5)]
    )  # the surface reaches beyond its targets
    reach = reach_of(driver, np.zeros(3), around, walk((0.0, 0.0), (-2.0, 1.0), (1.0, 5.0)))
    np.testing.assert_allclose(reach.around, around, atol=1e-9)
    np.testing.assert_allclose(
        reach.path, np.add(around, [(-2.0, 0.0, 0.0), (1.0, 0.0, 5.0)]), atol=1e-9
    )
    np.testing.assert_allclose(reach.way, [[-2.0, 0.0], [1.0, 5.0]], atol=1e-9)
    assert driver.resets == 4, "each pose by itself, and no trace"


def test_who_turns_fills_more_than_what_was_tried() -> None:
    turned = walk((0.0, 0.0), heading=np.pi / 2.0)
    reach = reach_of(Walker(True), np.zeros(3), BOX, turned)
    assert np.ptp(reach.around[:, 2]) == pytest.approx(np.ptp(BOX[:, 0]))
    np.testing.assert_array_equal(reach.path, reach.around)


def test_a_driver_of_bodies_is_asked_for_its_path() -> None:
    figure = replace(FIGURE, plan=plan_by_names(FIGURE.skeleton))
    puppet, joints = Puppet(figure), tuple(Performer(BODY).joints)
    driver = BodyDriver(Pairing(BODY, joints, figure, puppet.bound_skeleton, puppet.surface, None))
    poses = walk((0.0, 0.0), (3.0, 0.0))
    driver.prepare(poses, rest_state(poses[0]))
    reach = reach_of(driver, puppet.root, BOX, poses)
    assert np.ptp(reach.way[:, 0]) > 1.0
    assert np.ptp(reach.way[:, 1]) < 1e-9
