"""The scene: who stands where, what the camera sees, and the chains that light up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import moderngl
import numpy as np
import pytest

from devices.skeleton import Skeleton
from runtime.driving.mapping import Mapping
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.driving.reach import Reach
from runtime.puppet.puppet import Motion, Puppet
from runtime.render.background import NOTHING
from runtime.render.camera import Camera, box_corners
from runtime.show.scene import BLACKOUT, GAP, Scene
from tests.runtime.stick_figures import (
    ARMS,
    BODY,
    FRONT_VIEW,
    T_POSE,
    driven_by,
    frame,
    make_figure,
    pose,
    seen,
)

SIZE = (96, 54)
WIDE = ((0.24, 0.72, -0.16), (1.6, 0.96, 0.16))


@pytest.fixture(scope="module")
def puppets() -> list[Puppet]:
    return [Puppet(make_figure(name="one")), Puppet(make_figure(WIDE, name="two"))]


@pytest.fixture
def scenes(context: moderngl.Context) -> Iterator[list[Scene]]:
    """Where a test puts the scenes that it opens."""
    opened: list[Scene] = []
    yield opened
    for scene in opened:
        scene.close()
    assert context.error == "GL_NO_ERROR"


def rested(puppets: Sequence[Puppet]) -> list[Motion]:
    """Every puppet driven by both arms, at rest."""
    start = seen(pose())
    for puppet in puppets:
        puppet.rest()
        puppet.surface.reset()
        driven_by(puppet, ARMS, rest_state(start))
    return [puppet.deform() for puppet in puppets]


def reach(camera: Camera, boxes: np.ndarray, aspect: float) -> np.ndarray:
    """How far from the middle (n, 2) the corners of boxes are in the picture, 1 at its edge."""
    corners = box_corners(np.asarray(boxes))
    points = np.column_stack([corners, np.ones(len(corners))])
    clip = points @ (camera.projection(aspect) @ camera.view).T
    assert (clip[:, 3] > 0.0).all(), "before the camera"
    return np.abs(clip[:, :2] / clip[:, 3:])


def test_those_on_stage_stand_side_by_side(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    row = [puppets[0], puppets[1], puppets[0]]
    scenes.append(Scene(context, SIZE, row, BODY))
    boxes = scenes[0].stage.boxes
    gaps = boxes[1:, 0, 0] - boxes[:-1, 1, 0]
    np.testing.assert_allclose(gaps, GAP, atol=1e-6)
    assert boxes[0, 0, 0] == pytest.approx(-boxes[-1, 1, 0]), "the row is in the middle"
    scenes.append(Scene(context, SIZE, puppets[:1], BODY))
    vertices = puppets[0].character.vertices
    alone = [vertices.min(axis=0), vertices.max(axis=0)]
    np.testing.assert_allclose(scenes[1].stage.boxes[0], alone, atol=1e-6)


@pytest.mark.parametrize("size", [SIZE, (40, 90)])
def test_the_camera_sees_everybody_with_room_to_move(
    context: moderngl.Context,
    puppets: list[Puppet],
    scenes: list[Scene],
    size: tuple[int, int],
) -> None:
    scenes.append(Scene(context, size, puppets, BODY))
    scene = scenes[0]
    shares = reach(scene.camera, scene.stage.boxes, scene.stage.aspect)
    assert shares.max() < 0.8
    assert shares[:, 0].max() > 0.5 or shares[:, 1].max() > 0.5, "and not from afar"


@pytest.mark.parametrize("size", [SIZE, (40, 90)])
def test_the_camera_sees_all_that_is_filled_in_the_show(
    context: moderngl.Context,
    puppets: list[Puppet],
    scenes: list[Scene],
    size: tuple[int, int],
) -> None:
    scenes.append(Scene(context, size, puppets, BODY))
    scene = scenes[0]
    filled = np.array([[[-1.0, 0.0, -0.5], [1.0, 4.0, 0.5]], [[-3.0, 0.0, -2.0], [2.0, 1.0, 2.5]]])
    scene.frame_all([Reach(box, box) for box in filled])
    places = np.array([character.position for character in scene._characters])
    shares = reach(scene.camera, filled + places[:, None], scene.stage.aspect)
    assert shares.max() <= 0.8 + 1e-6, "inside the margins"
    assert shares.max() > 0.7, "which it fills"
    at_rest = reach(scene.camera, scene.stage.boxes, scene.stage.aspect)
    assert at_rest.max() <= 0.8 + 1e-6
    rotation = scene.camera.view_rotation
    scene.camera = scene.camera.zoom(3.0)
    scene.frame_all()
    np.testing.assert_allclose(scene.camera.view_rotation, rotation, atol=1e-12)
    again = reach(scene.camera, filled + places[:, None], scene.stage.aspect)
    np.testing.assert_allclose(again, shares, atol=1e-6)


def test_framing_does_not_move_who_is_framed(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    scenes.append(Scene(context, SIZE, puppets, BODY))
    scene = scenes[0]
    before, camera = scene.stage.boxes.copy(), scene.camera
    for _ in range(3):
        scene.frame_all()
    np.testing.assert_array_equal(scene.stage.boxes, before)
    np.testing.assert_allclose(scene.camera.eye, camera.eye, atol=1e-9)
    np.testing.assert_allclose(scene.camera.target, camera.target, atol=1e-9)


class Abroad(Puppet):
    """A puppet that travels as a test says."""

    away = (0.0, 0.0)

    @property
    def travelled(self) -> np.ndarray:
        return np.array(self.away)

    def motion(self) -> Motion:
        moved = self.character.vertices + np.array([self.away[0], 0.0, self.away[1]])
        return Motion(np.ascontiguousarray(moved), None)


def reach_along(puppet: Puppet, way: tuple[float, float]) -> Reach:
    vertices = puppet.character.vertices
    box = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    moved = box + np.array([way[0], 0.0, way[1]])
    return Reach(box, np.array([np.minimum(box, moved)[0], np.maximum(box, moved)[1]]))


def sent(scene: Scene, puppet: Abroad, way: tuple[float, float], seconds: float = 6.0) -> None:
    """Let a puppet walk this way, and the scene glide after it until it rests."""
    for number in range(round(seconds * 30)):
        share = min(number / (seconds * 15.0), 1.0)
        puppet.away = (share * way[0], share * way[1])
        scene.follow(number / 30.0)


@pytest.fixture
def abroad() -> Abroad:
    return Abroad(make_figure(name="one"))


@pytest.mark.parametrize("way", [(8.0, 0.0), (-3.0, -6.0), (0.0, 7.0)])
@pytest.mark.parametrize("is_live", [False, True])
def test_who_goes_far_is_followed_by_camera_light_and_curtain(
    context: moderngl.Context,
    abroad: Abroad,
    scenes: list[Scene],
    way: tuple[float, float],
    is_live: bool,
) -> None:
    scenes.append(Scene(context, SIZE, [abroad], BODY))
    scene = scenes[0]
    if not is_live:
        scene.frame_all([reach_along(abroad, way)])
    scene.show(None, [abroad.motion()])
    home = scene.picture().astype(int)
    sent(scene, abroad, way)
    scene.show(None, [abroad.motion()])
    there = scene.picture().astype(int)
    shares = reach(scene._gliding_camera(), scene.stage.boxes, scene.stage.aspect)
    assert shares.max() < 0.95, "the puppet is in the picture"
    assert there[..., :3].mean() == pytest.approx(home[..., :3].mean(), rel=0.15), (
        "and in its light"
    )
    edges = np.concatenate([home[:, 0], home[:, -1]]), np.concatenate([there[:, 0], there[:, -1]])
    assert edges[1][:, :3].mean() > 0.5 * edges[0][:, :3].mean(), "with the curtain at its sides"


def test_a_short_way_is_seen_whole_by_a_camera_that_stands_still(
    context: moderngl.Context, abroad: Abroad, scenes: list[Scene]
) -> None:
    scenes.append(Scene(context, SIZE, [abroad], BODY))
    scene = scenes[0]
    scene.frame_all([reach_along(abroad, (1.0, 0.0))])
    still = scene.camera
    for way in ((0.0, 0.0), (1.0, 0.0)):
        sent(scene, abroad, way)
        scene.show(None, [abroad.motion()])
        assert scene._gliding_camera() is still
        assert reach(still, scene.stage.boxes, scene.stage.aspect).max() <= 0.8 + 1e-6


def test_who_stays_in_place_is_framed_there_and_followed_if_let_go(
    context: moderngl.Context, abroad: Abroad, scenes: list[Scene]
) -> None:
    scenes.append(Scene(context, SIZE, [abroad], BODY))
    scene = scenes[0]
    scene.frame_all([reach_along(abroad, (1.0, 0.0))])
    whole = scene.camera
    abroad.travel.in_place = True
    scene.frame_all()
    assert scene.camera.distance < whole.distance
    sent(scene, abroad, (1.0, 0.0))
    assert scene._gliding_camera().target[0] > 0.8


def test_what_the_user_does_with_the_camera_stays_on_top(
    context: moderngl.Context, abroad: Abroad, scenes: list[Scene]
) -> None:
    scenes.append(Scene(context, SIZE, [abroad], BODY))
    scene = scenes[0]
    sent(scene, abroad, (5.0, -2.0))
    before = scene._gliding_camera()
    scene.camera = scene.camera.zoom(2.0).orbit(0.3, 0.1)
    after = scene._gliding_camera()
    assert after.distance == pytest.approx(before.distance / 2.0)
    np.testing.assert_allclose(after.target, before.target, atol=1e-9)
    np.testing.assert_allclose(after.view_rotation, scene.camera.view_rotation, atol=1e-12)


def test_those_who_part_are_all_in_view(
    context: moderngl.Context, abroad: Abroad, scenes: list[Scene]
) -> None:
    pair = [abroad, Abroad(make_figure(WIDE, name="two"))]
    scenes.append(Scene(context, SIZE, pair, BODY))
    scene = scenes[0]
    for number in range(200):
        pair[0].away, pair[1].away = (-number / 40.0, 0.0), (number / 40.0, 0.0)
        scene.follow(number / 30.0)
    scene.show(None, [puppet.motion() for puppet in pair])
    shares = reach(scene._gliding_camera(), scene.stage.boxes, scene.stage.aspect)
    assert shares.max() < 0.95


def test_a_scene_put_back_draws_the_same(
    context: moderngl.Context, abroad: Abroad, scenes: list[Scene]
) -> None:
    scenes.append(Scene(context, SIZE, [abroad], BODY))
    scene = scenes[0]
    sent(scene, abroad, (3.0, 0.0), 2.0)
    state, there = scene.snapshot(), abroad.away
    scene.show(None, [abroad.motion()])
    was = scene.picture()
    sent(scene, abroad, (-4.0, 1.0))
    scene.restore(state)
    abroad.away = there
    scene.show(None, [abroad.motion()])
    np.testing.assert_array_equal(scene.picture(), was)


def picture(scene: Scene, puppets: Sequence[Puppet], moment: Pose | None) -> np.ndarray:
    scene.show(moment, [puppet.deform() for puppet in puppets])
    return scene.picture().astype(int)


def differ(one: np.ndarray, two: np.ndarray) -> int:
    """How many pixels differ by more than an eighth of the range."""
    return int((np.abs(one - two)[..., :3].max(axis=2) > 32).sum())


def test_matched_chains_light_up_unless_they_are_hidden(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one = puppets[:1]
    rested(one)
    scenes.append(Scene(context, SIZE, one, BODY))
    scene = scenes[0]
    assert scene.highlights
    lit = picture(scene, one, None)
    scene.highlights = False
    dark = picture(scene, one, None)
    assert differ(lit, dark) > 20
    scene.highlights = True
    np.testing.assert_array_equal(picture(scene, one, None), lit)
    one[0].driver.show(Mapping(()), FRONT_VIEW)
    np.testing.assert_array_equal(picture(scene, one, None), dark)


def test_what_is_uploaded_needs_no_chains_and_is_drawn_with_them(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one = puppets[:1]
    motions = rested(one)
    scenes.append(Scene(context, SIZE, one, BODY))
    character = scenes[0]._characters[0]
    scenes[0].upload(motions)
    assert len(character.tubes) == 0, "what the vertices do not need is left for the drawing"
    scenes[0].draw(None)
    lit = [each.points for each in one[0].highlights]
    assert len(lit) == len(ARMS)
    assert len(character.tubes) == 2 * sum(len(chain) - 1 for chain in lit) + sum(map(len, lit))


def test_the_mirror_shows_the_performer(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one = puppets[:1]
    rested(one)
    scenes.append(Scene(context, SIZE, one, BODY))
    scene = scenes[0]
    without = picture(scene, one, None)
    standing = picture(scene, one, seen(pose()))
    level = picture(scene, one, seen(pose(T_POSE)))
    assert differ(without, standing) > 50
    assert differ(standing, level) > 2
    changed = np.argwhere(np.abs(standing - without).max(axis=2) > 32)
    assert np.ptp(changed[:, 1]) < SIZE[0] / 2, "in a corner, and nowhere else"


def test_who_moves_is_seen_moving(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    rested(puppets)
    scenes.append(Scene(context, SIZE, puppets, BODY))
    scene = scenes[0]
    scene.highlights = False
    still = picture(scene, puppets, None)
    puppets[1].follow(seen(pose({"ShoulderRight": (0.0, 0.0, -1.4)})))
    moved = picture(scene, puppets, None)
    assert differ(still, moved) > 20
    columns = np.flatnonzero(np.abs(moved - still).max(axis=(0, 2)) > 60)
    low, high = scene.stage.boxes[0, :, 0]
    edge = reach(scene.camera, np.array([[[low, 0, 0], [high, 1, 0]]]), scene.stage.aspect)
    assert columns.min() > SIZE[0] / 2 * (1.0 - edge[:, 0].max()), "beside the first"


def test_a_plain_picture_has_neither_mirror_nor_chains(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one = puppets[:1]
    rested(one)
    scenes.append(Scene(context, SIZE, one, BODY, plain=True))
    scenes.append(Scene(context, SIZE, one, BODY))
    plain = picture(scenes[0], one, seen(pose()))
    np.testing.assert_array_equal(plain, picture(scenes[0], one, None))
    scenes[1].highlights = False
    np.testing.assert_array_equal(plain, picture(scenes[1], one, None))


def test_a_transparent_stage_shows_the_character_alone(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one = puppets[:1]
    rested(one)
    scenes.append(Scene(context, SIZE, one, BODY, background=NOTHING))
    shown = picture(scenes[0], one, seen(pose()))
    assert shown[0, 0, 3] == shown[-1, -1, 3] == 0
    assert 0.02 < (shown[..., 3] > 128).mean() < 0.6


def test_a_blackout_fades_all_to_black_and_back(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one, now = puppets[:1], [10.0]
    rested(one)
    scene = Scene(context, SIZE, one, BODY, clock=lambda: now[0])
    scenes.append(scene)
    light = picture(scene, one, seen(pose()))[..., :3].astype(int)
    scene.blackout.to(1.0)
    levels = []
    for now[0] in (10.0, 10.1, 10.2, 10.0 + BLACKOUT, 20.0):
        shown = picture(scene, one, seen(pose()))[..., :3].astype(int)
        assert (shown <= light).all()
        levels.append(shown.sum() / light.sum())
    assert levels[0] == 1.0 > levels[1] > 0.5 > levels[2] > levels[3] == levels[4] == 0.0
    scene.blackout.to(0.0)
    now[0] += BLACKOUT
    np.testing.assert_array_equal(picture(scene, one, seen(pose()))[..., :3], light)


def test_any_performer_fits_into_the_mirror(
    context: moderngl.Context, puppets: list[Puppet], scenes: list[Scene]
) -> None:
    one = puppets[:1]
    rested(one)
    one[0].driver.show(Mapping(()), FRONT_VIEW)
    lone = Skeleton(("only",), np.array([-1]), np.zeros((1, 3)))
    scenes.append(Scene(context, SIZE, one, lone))
    moment = Performer(lone).follow(frame(np.array([[0.0, 1.0, 0.0]])))
    assert picture(scenes[0], one, moment).shape == (54, 96, 4)
