"""The colours of what lights up: one for each part of the performer, on all who follow."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from runtime.driving.performer import rest_state
from runtime.puppet.puppet import Puppet
from runtime.render.tubes import PAIR_COLOURS
from runtime.show.lights import colour_numbers
from runtime.show.scene import Scene
from tests.runtime.show.framing import SIZE
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    LEGS,
    driven_by,
    make_figure,
    pose,
    seen,
)

COLOUR = slice(8, 11)  # of a tube


@pytest.mark.parametrize(
    ("sources", "numbers"),
    [
        ([], []),
        ([(1, 2), (3, 4), (1, 2)], [0, 1, 0]),
        ([(1, 2, 3), (2, 3, 4), (2, 3)], [0, 0, 0]),  # to the wrist, to the fingertips
        ([(1, 2, 3), (2, 5)], [0, 1]),  # two that leave one joint
        ([(7,), (), (7,)], [0, 1, 0]),
    ],
)
def test_a_part_of_the_performer_has_one_colour(
    sources: list[tuple[int, ...]], numbers: list[int]
) -> None:
    assert colour_numbers(sources) == numbers


@pytest.fixture
def scene(context: moderngl.Context, scenes: list[Scene]) -> Scene:
    """Two figures: both arms of a performer drive one, the left arm and the legs the other."""
    puppets = [Puppet(make_figure(name="one")), Puppet(make_figure(name="two"))]
    for puppet, drives in zip(puppets, (ARMS, (*LEGS, ARMS[0])), strict=True):
        driven_by(puppet, drives, rest_state(seen(pose())))
    scenes.append(Scene(context, SIZE, puppets, BODY))
    scenes[0].upload([puppet.deform() for puppet in puppets])
    return scenes[0]


def colours_in(tubes: np.ndarray) -> set[int]:
    """The numbers of the pair colours that tubes have."""
    near = np.abs(tubes[:, None, COLOUR] - PAIR_COLOURS).max(axis=2) < 1e-6
    return set(np.flatnonzero(near.any(axis=0)).tolist())


def test_an_arm_lights_up_alike_on_all_whom_it_drives(scene: Scene) -> None:
    scene.draw(seen(pose()))
    one, two = (colours_in(character.tubes) for character in scene._characters)
    assert one == {0, 1}
    assert two == {0, 2, 3}, "the left arm as on the first figure, the legs in colours of their own"


def test_the_mirror_shows_what_drives_any_of_them(scene: Scene) -> None:
    scene.draw(seen(pose()))
    assert scene._inset is not None
    assert colours_in(scene._inset.capsules) == {0, 1, 2, 3}


def test_the_mirror_shows_only_what_its_own_performer_drives(scene: Scene) -> None:
    scene.performers = [0, 1]
    assert scene._inset is not None
    for focus, colours in ((0, {0, 1}), (1, {0, 2, 3})):
        scene.focus = focus
        scene.draw(seen(pose()))
        assert colours_in(scene._inset.capsules) == colours
