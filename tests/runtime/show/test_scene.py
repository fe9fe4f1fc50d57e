"""The scene: who stands where, what the camera sees, and the chains that light up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton
from runtime.driving.mapping import Mapping
from runtime.driving.performer import Performer, Pose, rest_state
from runtime.driving.reach import Reach
from runtime.puppet.puppet import Motion, Puppet
from runtime.render.background import NOTHING
from runtime.show.scene import BLACKOUT, GAP, NOTHING_TAKEN, Scene
from tests.runtime.show.framing import FULL, SIZE, WIDE, reach
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


@pytest.fixture(scope="module")
def puppets() -> list[Puppet]:
    return [Puppet(make_figure(name="one")), Puppet(make_figure(WIDE, name="two"))]


def rested(puppets: Sequence[Puppet]) -> list[Motion]:
    """Every puppet driven by both arms, at rest."""
    start = seen(pose())
    for puppet in puppets:
        puppet.rest()
        puppet.surface.reset()
        driven_by(puppet, ARMS, rest_state(start))
    return [puppet.deform() for puppet in puppets]


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
    assert shares.max() < FULL
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
    assert shares.max() <= FULL + 1e-6, "inside the margins"
    assert shares.max() > FULL - 0.1, "which it fills"
    at_rest = reach(scene.camera, scene.stage.boxes, scene.stage.aspect)
    assert at_rest.max() <= FULL + 1e-6
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


@pytest.mark.parametrize("quarters", [0, 1, -1])
def test_a_puppet_in_profile_has_its_performer_seen_from_the_same_side(
    context: moderngl.Context, scenes: list[Scene], quarters: int
) -> None:
    about = Rotation.from_rotvec([0.0, quarters * np.pi / 2.0, 0.0])
    figure = make_figure(name="one")
    names, parents = figure.skeleton.names, figure.skeleton.parents
    skeleton = Skeleton(names, parents, about.apply(figure.skeleton.rest_positions.copy()))
    plan = plan_by_names(skeleton)
    vertices = about.apply(figure.vertices.copy())
    puppet = Puppet(replace(figure, vertices=vertices, skeleton=skeleton, plan=plan))
    scenes.append(Scene(context, SIZE, [puppet], BODY))
    forward = {"ShoulderLeft": (-np.pi / 2.0, 0.0, 0.0), "ShoulderRight": (-np.pi / 2.0, 0.0, 0.0)}
    ends = []
    for turns in (T_POSE, forward):
        scenes[-1].draw(seen(pose(turns)))
        ends.append(scenes[-1]._inset.capsules[:, 4:6])
    widths = [np.ptp(each[:, 0]) for each in ends]
    assert (widths[0] > widths[1]) == (quarters == 0)
    from_head = ends[1][:, 0] - ends[1][np.argmax(ends[1][:, 1]), 0]
    assert np.sign(round(float(from_head.max() + from_head.min()), 2)) == quarters, "arms forward"


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


@pytest.mark.parametrize("taken", [(0.3, 0.0, 0.2, 0.1), (0.2, 0.25, 0.0, 0.3)])
def test_what_is_framed_is_drawn_clear_of_a_panel(
    context: moderngl.Context,
    puppets: list[Puppet],
    scenes: list[Scene],
    taken: tuple[float, float, float, float],
) -> None:
    scenes.append(Scene(context, (320, 180), puppets, BODY, background=NOTHING))
    scene = scenes[0]
    motions = rested(puppets)
    scene.show(None, motions)
    whole = scene.picture()
    scene.taken = taken
    scene.redraw()
    rows, columns = np.nonzero(scene.picture()[..., 3])
    left, right, top, bottom = taken
    assert columns.min() >= 320 * left
    assert columns.max() < 320 * (1.0 - right)
    assert rows.min() >= 180 * top
    assert rows.max() < 180 * (1.0 - bottom)
    assert np.ptp(columns) > 0.5 * 320 * (1.0 - left - right), "as large as there is room"
    scene.taken = NOTHING_TAKEN
    scene.redraw()
    np.testing.assert_array_equal(scene.picture(), whole)
