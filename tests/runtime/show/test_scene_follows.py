"""The scene goes along with characters that travel: camera, light and curtain."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from runtime.driving.reach import Reach
from runtime.puppet.puppet import Motion, Puppet
from runtime.show.scene import Scene
from tests.runtime.show.framing import FULL, SIZE, WIDE, reach
from tests.runtime.stick_figures import BODY, make_figure


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
        assert reach(still, scene.stage.boxes, scene.stage.aspect).max() <= FULL + 1e-6


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
