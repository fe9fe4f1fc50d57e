"""Who is who from picture to picture, and where their hands are."""

from __future__ import annotations

import numpy as np
import pytest

from devices.mediapipe.joints import POSE_LANDMARKS
from devices.webcam.hand_tiles import (
    FARTHEST,
    TILE,
    WIDTH,
    corner,
    hand_tiles,
    hands_of_tiles,
    mosaic_size,
    picture_to_tile,
    pixels_per_metre,
)
from devices.webcam.people import PeopleIds

SIZE = (640, 480)


def body(scale: float, at: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Landmarks (33, 4) [m] of a body, and (33, 2) [pixels] of its picture."""
    points = np.random.default_rng(3).uniform(-0.4, 0.4, size=(len(POSE_LANDMARKS), 3))
    world = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    return world, points[:, :2] * scale + at


def test_people_keep_their_ids_in_any_order() -> None:
    ids = PeopleIds()
    left, right = np.array([0.2, 0.5]), np.array([0.7, 0.5])
    assert ids([left, right]) == [0, 1]
    assert ids([right - 0.02, left + 0.02]) == [1, 0]
    assert ids([right]) == [1]
    assert ids([left, right]) == [2, 1]
    assert ids([]) == []
    assert ids([right]) == [3]


def test_one_id_is_never_given_twice() -> None:
    ids = PeopleIds()
    ids([np.array([0.5, 0.5])])
    assert ids([np.array([0.5, 0.51]), np.array([0.5, 0.505])]) == [1, 0]


@pytest.mark.parametrize("scale", [40.0, 300.0])
def test_the_scale_of_a_body_is_found_wherever_it_is(scale: float) -> None:
    world, picture = body(scale, (500.0, 20.0))
    found = pixels_per_metre(world[:, :2], picture, world[:, 3])
    assert found == pytest.approx(scale)
    assert pixels_per_metre(world[:, :2], picture, 0.0 * world[:, 3]) == 0.0
    assert pixels_per_metre(0.0 * world[:, :2], picture, world[:, 3]) == 0.0


def test_a_tile_shows_the_hand_in_its_middle_and_knows_the_wrist() -> None:
    world, picture = body(200.0, (320.0, 240.0))
    left, right = hand_tiles(world, picture, SIZE, row=1)
    assert (left.slot, right.slot) == (2, 3)
    assert left.width == pytest.approx(200.0 * WIDTH)
    knuckles = [POSE_LANDMARKS.index(f"left_{finger}") for finger in ("index", "pinky")]
    matrix = picture_to_tile(left)
    seen = matrix[:, :2] @ picture[knuckles].mean(axis=0) + matrix[:, 2]
    np.testing.assert_allclose(seen, (TILE / 2, TILE / 2))
    wrist = matrix[:, :2] @ picture[POSE_LANDMARKS.index("left_wrist")] + matrix[:, 2]
    np.testing.assert_allclose(left.wrist, wrist)


def test_no_tile_for_a_hand_that_is_hidden_outside_or_too_small() -> None:
    world, picture = body(200.0, (320.0, 240.0))
    hidden = world.copy()
    hidden[POSE_LANDMARKS.index("left_wrist"), 3] = 0.1
    assert [tile.slot for tile in hand_tiles(hidden, picture, SIZE, 0)] == [1]
    assert hand_tiles(world, picture + 1000.0, SIZE, 0) == []
    assert hand_tiles(world, picture * 0.1, SIZE, 0) == []


def test_each_slot_shows_the_hand_nearest_to_the_body_s_wrist() -> None:
    world, picture = body(200.0, (320.0, 240.0))
    tiles = hand_tiles(world, picture, SIZE, row=0)
    wrists = np.array([tile.wrist + corner(tile.slot) for tile in tiles])
    assert hands_of_tiles(tiles, wrists[::-1] + 3.0) == {0: 1, 1: 0}
    far = FARTHEST * TILE / WIDTH + 1.0
    assert hands_of_tiles(tiles[:1], wrists[:1] + np.array([far, 0.0])) == {}
    assert hands_of_tiles(tiles, np.empty((0, 2))) == {}


def test_slots_lie_side_by_side_within_the_mosaic() -> None:
    corners = [corner(slot) for slot in range(8)]
    assert len(set(corners)) == 8
    assert np.max(corners, axis=0).tolist() == [mosaic_size(4)[0] - TILE, mosaic_size(4)[1] - TILE]
