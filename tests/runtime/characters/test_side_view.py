"""Side views: characters that are long from front to back are turned."""

from dataclasses import replace

import numpy as np
import pytest

from devices.bodies.body_plan import BodyPlan
from devices.skeleton import Skeleton
from runtime.characters.builtin import builtin_character
from runtime.characters.character import Character
from runtime.characters.side_view import turned_to_best_side


def stretched(character: Character, scale: tuple[float, float, float]) -> Character:
    skeleton = character.skeleton
    return replace(
        character,
        vertices=character.vertices * scale,
        skeleton=Skeleton(skeleton.names, skeleton.parents, skeleton.rest_positions * scale),
    )


def test_a_character_that_faces_the_house_stays_as_it_is() -> None:
    mannequin = builtin_character("mannequin")
    assert turned_to_best_side(mannequin) is mannequin


def test_a_long_character_shows_its_side_and_looks_to_its_left() -> None:
    long = stretched(builtin_character("trex"), (1.0, 1.0, 4.0))
    turned = turned_to_best_side(long)
    assert np.ptp(turned.vertices, axis=0) == pytest.approx(
        np.ptp(long.vertices, axis=0)[[2, 1, 0]]
    )
    front = long.vertices[:, 2].argmax()
    assert turned.vertices[front, 0] == pytest.approx(long.vertices[front, 2])
    assert "side" in turned.notes[-1]


def test_a_turned_character_still_leads_back_to_its_file() -> None:
    long = stretched(builtin_character("trex"), (1.0, 1.0, 4.0))
    turned = turned_to_best_side(long)
    in_file = turned.in_file_coordinates(turned.vertices)
    assert in_file == pytest.approx(long.in_file_coordinates(long.vertices), abs=1e-12)


def test_a_turned_skeleton_stays_inside() -> None:
    long = stretched(builtin_character("trex"), (1.0, 1.0, 4.0))
    turned = turned_to_best_side(long)
    low, high = turned.vertices.min(axis=0), turned.vertices.max(axis=0)
    inside = turned.skeleton.rest_positions
    assert ((inside >= low) & (inside <= high)).all()


def test_a_snake_sways_toward_the_audience() -> None:
    long = stretched(builtin_character("trex"), (1.0, 1.0, 4.0))
    snake = replace(long, plan=BodyPlan((0, 1), (1, 2), 1))
    assert turned_to_best_side(snake) is snake
