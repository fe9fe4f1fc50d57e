"""Going on from a restored snapshot gives the same bytes as the first time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from runtime.driving.choices import Choices
from runtime.driving.exaggeration import Exaggeration
from runtime.driving.limb_release import LimbRelease
from runtime.driving.mapping import Mapping
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.driving.polyline_driver import PolylineDriver
from runtime.driving.unfreeze_blend import UnfreezeBlend
from runtime.puppet.deformable_surface import Elasticity
from runtime.puppet.puppet import Puppet
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    LEGS,
    T_POSE,
    driven_by,
    frame,
    make_figure,
    paired,
    pose,
    waving,
)

FIGURE = make_figure()
COUNT, AT = 24, 9  # frames in all, and before the snapshot


def poses() -> list[Pose]:
    """A performer who waves, hops and turns, and whose right arm is not seen for a while."""
    performer, found = Performer(BODY), []
    arm = list(ARMS[1].source[1:])
    for number, positions in enumerate(waving(COUNT)):
        moved = positions + np.array([0.0, 0.1 * np.sin(0.8 * number), 0.0])
        if 2 <= number < 2 * COUNT // 3:
            moved[arm] = np.nan
        found.append(performer.follow(frame(moved, number / 20.0)))
    return found


def check(make: Callable[[], Any], step: Callable[[Any, int], Any]) -> None:
    """Go on from a snapshot twice, and in another object that was made alike."""
    one, other = make(), make()
    for number in range(AT):
        step(one, number)
    state = one.snapshot()
    first = [step(one, number) for number in range(AT, COUNT)]
    for again in (one, one, other):
        again.restore(state)
        second = [step(again, number) for number in range(AT, COUNT)]
        for mine, theirs in zip(first, second, strict=True):
            np.testing.assert_array_equal(mine, theirs)
    assert any(not np.array_equal(first[0], each) for each in first), "something moved"


def test_an_exaggeration_goes_on_as_it_was() -> None:
    tips = np.random.default_rng(0).normal(0.0, 0.1, (COUNT, 2, 3)).cumsum(axis=0)

    def step(exaggeration: Exaggeration, number: int) -> np.ndarray:
        strain = exaggeration.strain(number / 30.0, tips[number], 0.01 * number, 1.0)
        return np.append(strain.limbs, strain.body)

    check(lambda: Exaggeration(np.ones(2), 1.7), step)


def test_a_limb_that_lets_go_goes_on_as_it_was() -> None:
    def step(limb_release: LimbRelease, number: int) -> np.ndarray:
        limb_release.follow(number / 12.0, np.array([number > COUNT // 2, True]))
        return limb_release.weights

    check(lambda: LimbRelease(2), step)


def test_a_blend_goes_on_as_it_was() -> None:
    moments, rests = poses(), [None]

    def step(blend: UnfreezeBlend, number: int) -> np.ndarray:
        if 3 <= number < AT - 2 or 12 <= number < 15:
            blend.freeze(number / 20.0)
            return np.zeros(1)
        followed = blend.follow(moments[number], number / 20.0, rests)
        return np.append(followed.seen.ravel(), [followed.heading, followed.time])

    check(lambda: UnfreezeBlend(BODY), step)


@pytest.fixture(scope="module")
def figures() -> list[Puppet]:
    return [Puppet(FIGURE), Puppet(FIGURE)]


@pytest.mark.parametrize("elasticity", [Elasticity(), Elasticity(cartoon=1.0, stiffness=0.5)])
def test_a_puppet_goes_on_as_it_was(figures: list[Puppet], elasticity: Elasticity) -> None:
    moments = poses()
    spare = iter(figures)

    def make() -> Puppet:
        puppet = next(spare)
        puppet.surface.elasticity = elasticity
        driven_by(puppet, (*ARMS, *LEGS), rest_state(moments[0]))
        puppet.rest()
        puppet.forget()
        return puppet

    def step(puppet: Puppet, number: int) -> np.ndarray:
        puppet.follow(moments[number])
        motion = puppet.deform()
        puppet.settle()
        lit = [each.points for each in puppet.highlights]
        return np.concatenate([motion.vertices, motion.nodes.positions, *lit])

    check(make, step)


def test_a_driver_takes_up_the_mapping_and_the_rest_state_of_a_snapshot(
    figures: list[Puppet],
) -> None:
    moments, puppet = poses(), figures[0]
    driver = driven_by(puppet, ARMS, rest_state(moments[0]))
    driver.gains = np.array([0.5, 0.9])
    state, wanted = driver.snapshot(), driver.targets(moments[5])
    driver.gains *= 0.5
    driver.show(Mapping(LEGS), FRONT_VIEW)
    driver.prepare((), rest_state(moments[3]))
    driver.targets(moments[6])
    other = PolylineDriver(paired(puppet))
    for each in (driver, other, driver):
        each.restore(state)
        found = each.targets(moments[5])
        np.testing.assert_array_equal(found.shape.positions, wanted.shape.positions)
        assert each.mapping.drives == ARMS
        each.gains *= 0.1
    driver.prepare((), None)
    resting = driver.snapshot()
    driver.restore(state)
    driver.restore(resting)
    assert driver.targets(moments[5]) is puppet.bound_skeleton.at_rest


def test_another_kind_of_driver_stays_and_begins_anew(figures: list[Puppet]) -> None:
    moments, puppet = poses(), figures[0]
    driver = driven_by(puppet, ARMS, rest_state(moments[0]))
    puppet.follow(moments[4])
    wanted = puppet.deform().vertices.copy()
    state = puppet.snapshot()

    class Other(PolylineDriver):
        resets = 0

        def reset(self) -> None:
            self.resets += 1
            super().reset()

    other = Other(paired(puppet))
    puppet.drive_with(other)
    puppet.follow(moments[8])
    puppet.deform()
    puppet.restore(state)
    assert other.resets == 1
    assert not other.mapping.drives
    np.testing.assert_allclose(puppet.deform().vertices, wanted, atol=0.02)
    assert driver.mapping.drives == ARMS


class Matched:
    """A puppet with a match session, and the state of both."""

    def __init__(self, puppet: Puppet) -> None:
        self.puppet = puppet
        self.performer = Performer(BODY)
        choices = Choices(patience=0.95)
        self.session = MatchSession(self.performer, [puppet], lambda: FRONT_VIEW, choices, [None])

    def snapshot(self) -> tuple[Any, Any]:
        return self.puppet.snapshot(), self.session.snapshot()

    def restore(self, state: tuple[Any, Any]) -> None:
        self.puppet.restore(state[0])
        self.session.restore(state[1])


def test_a_match_session_goes_on_as_it_was(figures: list[Puppet]) -> None:
    """The performer strikes one pose after another; which match is shown depends on all of them."""
    spare = iter(figures)

    def step(matched: Matched, number: int) -> np.ndarray:
        sides = {"SpineBase": (0.0, 0.0, np.pi)} if 4 <= number < 14 else T_POSE
        struck = frame(pose(sides), number / 10.0)
        matched.performer.follow(struck)
        matched.session.direct(struck)
        drives, rest = matched.session.mappings[0].drives, matched.session.rests[0]
        nodes = [node for drive in drives for node in drive.target]
        height = np.nan if rest is None else rest.height
        return np.array([matched.session.matching, height, *nodes])

    check(lambda: Matched(next(spare)), step)
