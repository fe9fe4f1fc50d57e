"""The stage drawn without a window: what is opaque, what is lit, what changes and what does not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from devices.errors import InputError
from runtime.characters.character import Material
from runtime.render.background import NOTHING, Background
from runtime.render.context import headless_context
from runtime.render.stage import Stage
from runtime.render.tubes import PAIR_COLOURS
from tests.runtime.render.shapes import CAMERA, SIZE, WHITE, ball, box, performer, sheet


@pytest.fixture(autouse=True)
def _no_gl_errors(request: pytest.FixtureRequest) -> Iterator[None]:
    yield
    if "context" in request.fixturenames:
        assert request.getfixturevalue("context").error == "GL_NO_ERROR"


@pytest.fixture
def stage(context: moderngl.Context) -> Iterator[Stage]:
    stage = Stage(context, SIZE)
    yield stage
    stage.release()


@pytest.fixture
def bare(context: moderngl.Context) -> Iterator[Stage]:
    stage = Stage(context, SIZE, background=NOTHING)
    yield stage
    stage.release()


def test_the_same_scene_is_the_same_picture_to_the_last_bit(context: moderngl.Context) -> None:
    pictures = []
    for _ in range(2):
        stage = Stage(context, SIZE)
        stage.add(ball(), caption="ball")
        for _ in range(2):  # the second time the backdrop is the one kept
            stage.draw(CAMERA, performer())
            pictures.append(stage.read().tobytes())
        stage.release()
    assert len(set(pictures)) == 1


def test_moved_vertices_change_the_picture_and_moving_back_restores_it(stage: Stage) -> None:
    shape = ball()
    character = stage.add(shape)
    pictures = []
    for shift in (0.0, 0.3, 0.0):
        character.update(np.add(shape.vertices, (shift, 0, 0)))
        stage.draw(CAMERA)
        pictures.append(stage.read())
    assert (pictures[0] != pictures[1]).any(axis=2).mean() > 0.02
    np.testing.assert_array_equal(pictures[0], pictures[2])


def test_vertices_of_another_mesh_are_refused(stage: Stage) -> None:
    with pytest.raises(ValueError, match=r"Expected `vertices` to have shape \(642, 3\)"):
        stage.add(ball()).update(np.zeros((4, 3)))


def test_without_a_house_only_the_character_is_opaque(bare: Stage) -> None:
    bare.add(ball())
    bare.draw(CAMERA)
    picture = bare.read()
    alpha = picture[..., 3]
    assert alpha[0].max() == alpha[-1].max() == 0
    assert alpha[90, 160] == 255
    assert set(np.unique(alpha)) <= {0, 63, 64, 127, 128, 191, 192, 255}  # 4 samples at edges
    assert 0.02 < ((alpha > 0) & (alpha < 255)).sum() / (alpha == 255).sum() < 0.2
    edge = (alpha > 100) & (alpha < 200)
    assert picture[edge, 0].mean() > 60  # straight, not darkened towards the transparent side


@pytest.mark.parametrize("colour", [(0, 255, 0), (32, 48, 64)])
def test_a_plain_background_is_that_colour_exactly_and_nothing_falls_on_it(
    context: moderngl.Context, bare: Stage, colour: tuple[int, int, int]
) -> None:
    bare.add(ball())
    bare.draw(CAMERA)
    alone = bare.read()
    stage = Stage(context, SIZE, background=Background(*colour))
    stage.add(ball())
    stage.draw(CAMERA)
    picture = stage.read()
    stage.release()
    assert (picture[..., 3] == 255).all()
    empty, full = alone[..., 3] == 0, alone[..., 3] == 255
    assert (picture[empty][:, :3] == colour).all(), "no shadow, no reflection, no noise"
    np.testing.assert_array_equal(picture[full], alone[full], "and the character as without it")


def test_laid_over_anything_the_transparent_picture_is_the_one_drawn_there(
    context: moderngl.Context, bare: Stage
) -> None:
    """No halo: edges are as if the character had been drawn on the colour in the first place."""
    bare.add(ball())
    bare.draw(CAMERA)
    straight = bare.read().astype(float)
    share = straight[..., 3:] / 255.0
    for colour in ((0, 255, 0), (255, 255, 255), (0, 0, 0)):
        stage = Stage(context, SIZE, background=Background(*colour))
        stage.add(ball())
        stage.draw(CAMERA)
        drawn = stage.read()[..., :3].astype(float)
        stage.release()
        laid = straight[..., :3] * share + np.array(colour) * (1.0 - share)
        assert np.abs(laid - drawn).max() <= 2.0


@pytest.mark.parametrize("background", [None, NOTHING, Background(0, 255, 0)])
def test_the_stage_goes_dark_down_to_black_or_to_the_background_alone(
    context: moderngl.Context, background: Background | None
) -> None:
    stage = Stage(context, SIZE, background=background)
    character = stage.add(ball(), caption="ball")
    pictures = []
    for stage.brightness in (1.0, 0.5, 0.0, 1.0):
        stage.draw(CAMERA, performer())
        pictures.append(stage.read().astype(int))
    light, half, dark, again = pictures
    np.testing.assert_array_equal(again, light)
    if background is None:
        assert (dark[..., :3] == 0).all()
        assert (dark[..., 3] == 255).all()
        assert np.abs(half[..., :3] - light[..., :3] / 2.0).max() <= 1.0
    else:
        stage.remove(character)
        stage.draw(CAMERA)
        np.testing.assert_array_equal(dark, stage.read())
        assert abs(half[90, 160, 3] - (128 if background is NOTHING else 255)) <= 1
    stage.release()


def test_the_house_is_opaque_everywhere(stage: Stage) -> None:
    stage.add(ball())
    stage.draw(CAMERA)
    assert (stage.read()[..., 3] == 255).all()


def test_a_shadow_falls_on_the_floor_away_from_the_key_light(stage: Stage) -> None:
    stage.add(ball(), position=(0, 0, 0))
    stage.draw(CAMERA)
    with_ball = stage.read().astype(int)[..., :3].sum(axis=2)
    stage_only = Stage(stage._context, SIZE)
    stage_only.add(ball(height=1.4), position=(0, -5.0, 0))  # under the floor: the pool stays
    stage_only.draw(CAMERA)
    darker = stage_only.read().astype(int)[..., :3].sum(axis=2) - with_ball
    stage_only.release()
    floor = darker[120:, :]  # below the ball's middle
    assert floor[:, 190:].max() > 60  # the key comes from the left
    assert floor[:40, 190:].sum() > 2 * np.abs(floor[:40, :110]).sum()


def test_what_is_below_the_floor_is_hidden_by_it(stage: Stage, bare: Stage) -> None:
    for where in (stage, bare):
        character = where.add(box((-0.3, -1.0, -0.3), (0.3, -0.2, 0.3)))
        pictures = []
        for depth in (0.0, 50.0):
            character.position = np.array([0.0, -depth, 0.0])
            where.draw(CAMERA)
            pictures.append(where.read())
        hidden = np.array_equal(pictures[0], pictures[1])
        assert hidden is (where is stage)  # without a floor there is nothing to hide it


def test_both_sides_of_a_sheet_are_lit_alike(context: moderngl.Context) -> None:
    shape = sheet()
    turned = replace(
        shape,
        faces=shape.faces[:, ::-1].copy(),
        surface=replace(shape.surface, faces=shape.surface.faces[:, ::-1].copy()),
    )
    pictures = []
    for either in (shape, turned):  # the camera sees the front of one, the back of the other
        stage = Stage(context, SIZE, background=NOTHING)
        stage.add(either)
        stage.draw(CAMERA)
        pictures.append(stage.read().astype(int))
        stage.release()
    assert (pictures[0][85:95, 155:165, 3] == 255).all()
    assert pictures[0][85:95, 155:165, 0].mean() > 150
    assert np.abs(pictures[0] - pictures[1]).max() <= 1


def test_a_sheet_seen_from_behind_is_not_black(bare: Stage) -> None:
    bare.add(sheet())
    bare.draw(CAMERA.orbit(np.pi, 0.0))
    middle = bare.read()[85:95, 155:165].astype(int)
    assert (middle[..., 3] == 255).all()
    assert middle[..., 0].mean() > 50


def test_textures_have_their_first_row_at_v_zero(bare: Stage) -> None:
    image = np.zeros((16, 16, 4), dtype=np.uint8)
    image[..., 3] = 255
    image[:8, :, 0] = 255  # the first row is red and lies at v = 0: the sheet's top
    image[8:, :, 2] = 255
    material = Material(np.ones(4, dtype=np.float32), image)
    bare.add(sheet(WHITE, material))
    bare.draw(CAMERA)
    picture = bare.read().astype(int)
    inked = np.flatnonzero(picture[:, 160, 3] == 255)
    top, bottom = picture[inked[8], 160], picture[inked[-9], 160]
    assert top[0] > 1.3 * top[2]
    assert bottom[2] > 1.3 * bottom[0]


def test_see_through_material_lets_the_background_through(bare: Stage) -> None:
    bare.add(sheet(material=Material(np.array([1, 1, 1, 0.5], dtype=np.float32))))
    bare.draw(CAMERA)
    assert 90 < bare.read()[80:100, 150:170, 3].mean() < 165


def test_highlighted_chains_show_through_the_surface_and_can_be_put_out(bare: Stage) -> None:
    character = bare.add(ball())
    bare.draw(CAMERA)
    plain = bare.read()
    character.highlight([[[0, 0.5, 0], [0, 0.9, 0]]], [PAIR_COLOURS[1]])  # in the ball's middle
    bare.draw(CAMERA)
    lit = bare.read().astype(int)
    changed = (lit != plain).any(axis=2)
    assert 20 < changed.sum() < 4000
    brightest = lit[changed][:, 2].max()
    assert brightest > 180  # sky blue over a red ball
    character.highlight([], [])
    bare.draw(CAMERA)
    np.testing.assert_array_equal(bare.read(), plain)


def test_resize_keeps_the_characters(stage: Stage) -> None:
    stage.add(ball())
    stage.resize((200, 100))
    stage.draw(CAMERA)
    picture = stage.read()
    assert picture.shape == (100, 200, 4)
    assert picture[50, 100, 0] > picture[50, 100, 2] + 40


def test_a_removed_character_is_gone(bare: Stage) -> None:
    character = bare.add(ball())
    bare.remove(character)
    bare.draw(CAMERA)
    assert not bare.read().any()


def test_a_picture_too_large_or_empty_is_refused(context: moderngl.Context) -> None:
    for size in ((0, 90), (10**6, 90)):
        with pytest.raises(InputError, match="cannot be drawn here; choose a --size"):
            Stage(context, size)


def test_more_characters_than_pools_are_refused(stage: Stage) -> None:
    tiny = box((0, 0, 0), (0.1, 0.1, 0.1))
    for _ in range(16):
        stage.add(tiny)
    with pytest.raises(InputError, match="holds 16 characters at most"):
        stage.add(tiny)


@pytest.mark.parametrize("missing", ["libegl", "libgl"])
def test_a_missing_library_is_one_line_that_says_what_to_install(missing: str) -> None:
    with pytest.raises(InputError) as caught:
        headless_context(**{missing: "libNotHere.so.1"})
    message = str(caught.value)
    assert "libNotHere.so.1" in message
    assert "apt-get install libegl1 libgl1 libgl1-mesa-dri" in message
    assert "\n" not in message
