"""What lies under a place of the picture: lines, surfaces and the small picture, in any view."""

from __future__ import annotations

import time
from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from runtime.driving.by_hand.choosing import Target
from runtime.render.picking import on_screen
from solvers.surface.ray_hit import ray_hit
from tests.runtime.control.by_hand.hand_show import HandShow

LIMIT = 0.002  # [s] for finding what lies under the mouse, on a free core


@pytest.fixture(scope="module")
def show(context: moderngl.Context) -> Iterator[HandShow]:
    with HandShow(context, ("squid", "trex")) as show:
        yield show


def test_every_part_of_the_performer_is_found_in_the_small_picture(show: HandShow) -> None:
    for name in ("left arm", "right arm", "left leg", "right leg", "head", "trunk"):
        found = show.pickable.under(show.of_performer(name))
        assert show.pickable.name(found) == name


def test_the_rest_of_the_small_picture_is_nothing(show: HandShow) -> None:
    (x, y), radius = show.scene.inset_circle
    assert show.pickable.under((x - 0.8 * radius, y + 0.5 * radius)) is None


@pytest.mark.parametrize("turn", [0.0, 0.6, -1.1])
def test_the_line_of_each_part_is_found_where_it_is_now(show: HandShow, turn: float) -> None:
    show.scene.camera = show.scene.camera.orbit(turn, 0.2)
    show.perform(4)
    for number in (0, 1):
        parts = show.pickable.character(number)
        for chain, name in enumerate(parts.names):
            tip = show.of_character(name, number, share=1.0)
            found = show.pickable.under(tip)
            assert isinstance(found, Target)
            if found != Target(number, chain):  # another line runs there too
                line = list(show.pickable.nodes(found))
                points = show.puppets[found.character].places[line]
                points = points + show.scene.position(found.character)
                places = on_screen(show.scene.seen_by, show.scene.stage.size, points)
                assert np.linalg.norm(places - tip, axis=1).min() < 40.0


def test_a_surface_far_from_lines_belongs_to_the_part_that_it_moves_with(show: HandShow) -> None:
    """Rays at middles of triangles that the camera sees find the part of one of their corners."""
    puppet, chains = show.puppets[0], show.pickable._chains_of_vertices(0)
    points, faces = puppet.shown + show.scene.position(0), puppet.character.faces
    eye, tried = np.array(show.scene.seen_by.eye), 0
    for face in range(0, len(faces), 197):
        middle = points[faces[face]].mean(axis=0)
        hit = ray_hit(points, faces, eye, middle - eye)
        if hit is None or hit.face != face:
            continue  # hidden by another part
        at = on_screen(show.scene.seen_by, show.scene.stage.size, middle[None])[0]
        found = show.pickable._on_surface((float(at[0]), float(at[1])))
        assert isinstance(found, Target)
        assert found.chain in chains[faces[face]]
        tried += 1
    assert tried > 30


def test_beside_everything_lies_nothing(show: HandShow) -> None:
    width, height = show.scene.stage.size
    assert show.pickable.under((width - 3.0, 3.0)) is None
    assert show.pickable.under((width - 3.0, height - 3.0)) is None


def test_what_lies_there_is_found_within_two_milliseconds(show: HandShow) -> None:
    places = [(float(x), float(y)) for x in range(300, 900, 60) for y in range(60, 500, 60)]
    show.pickable.under(places[0])
    spent = []
    for at in places:
        began = time.process_time()
        show.pickable.under(at)
        spent.append(time.process_time() - began)
    assert np.median(spent) < 5.0 * LIMIT, "five times the limit: other programs run too"
