"""Golden pictures of whole scenes, and proof that a fault in the renderer changes them.

`pytest tests/runtime/render/test_golden.py --regenerate-golden` draws them anew: look at each. They
are compared on Mesa's llvmpipe only; other drivers place the samples of edges elsewhere.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import moderngl
import numpy as np
import pytest
import trimesh

from runtime.characters.character import Character, Material
from runtime.render import programs
from runtime.render.background import NOTHING, Background
from runtime.render.caption import CaptionPainter
from runtime.render.context import renderer_name
from runtime.render.floor import ShadowMaps
from runtime.render.inset import InsetPainter
from runtime.render.stage import Stage
from runtime.render.stage_character import StageCharacter
from runtime.render.tubes import PAIR_COLOURS
from tests.runtime.render.golden import (
    FOLDER,
    Comparison,
    Picture,
    assert_like_golden,
    golden_picture,
    save_golden,
)
from tests.runtime.render.shapes import (
    BLUE,
    CAMERA,
    GREEN,
    RED,
    SIZE,
    WHITE,
    ball,
    box,
    character_of,
    performer,
    ring,
    sheet,
)

CHAINS = [[[-0.4, 0.6, 0], [0, 0.9, 0.1], [0.4, 0.6, 0]], [[0, 0.3, 0], [0.2, 0.1, 0.1]]]


def framed(stage: Stage, yaw: float = 0.0, pitch: float = 0.0) -> Stage:
    """The stage with everything on it in view, drawn."""
    stage.draw(CAMERA.orbit(yaw, pitch).frame(stage.boxes, stage.aspect))
    return stage


def checked() -> Material:
    """A texture of black and golden squares."""
    checks = np.zeros((8, 8, 4), dtype=np.uint8)
    checks[..., 3] = 255
    checks[(np.indices((8, 8)).sum(axis=0) % 2) == 0, :3] = 230, 190, 60
    return Material(np.ones(4, dtype=np.float32), checks)


def painted() -> Character:
    """A ball in all colours, one at each vertex."""
    plain = ball()
    heights = plain.vertices / 1.4 + (0.5, 0.0, 0.5)
    return ball(np.column_stack([heights, np.ones(len(heights))]))


def bumpy() -> Character:
    """A dense surface (40 962 vertices) with fine ripples, as one that follows its proxy."""
    dense = trimesh.creation.icosphere(subdivisions=6, radius=0.7)
    ripples = 1.0 + 0.04 * np.sin(18.0 * dense.vertices).prod(axis=1)
    return character_of(ripples[:, None] * dense.vertices + (0, 0.75, 0), dense.faces, BLUE)


def single(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE)
    stage.add(ball())
    return framed(stage)


def captions(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE)
    stage.add(ball(BLUE), position=(-1.5, 0, 0), caption="ball")
    stage.add(ring(), caption="ring")
    stage.add(box((-0.4, 0, -0.4), (0.4, 1, 0.4)), position=(1.4, 0, 0), caption="box")
    return framed(stage)


def chains(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE)
    for place, shape in ((-0.8, ball(BLUE)), (0.8, ring())):
        character = stage.add(shape, position=(place, 0, 0))
        character.highlight(CHAINS, PAIR_COLOURS[:2])
    return framed(stage)


def inset(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE)
    stage.add(ball(GREEN))
    stage.draw(CAMERA, performer())
    return stage


def transparent(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE, background=NOTHING)
    stage.add(sheet(WHITE, checked()))
    stage.draw(CAMERA.orbit(0.5, 0.2))
    return stage


def chroma(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE, background=Background(0, 177, 64))
    stage.add(ring(RED), position=(-0.7, 0, 0))
    stage.add(painted(), position=(0.7, 0, 0))
    return framed(stage)


def materials(context: moderngl.Context) -> Stage:
    """A texture, colours at the vertices, and a pane of glass in front of a box."""
    stage = Stage(context, SIZE)
    stage.add(sheet(WHITE, checked()), position=(-1.4, 0, 0))
    stage.add(painted())
    glass = Material(np.array([0.6, 0.8, 1.0, 0.4], dtype=np.float32))
    stage.add(sheet(WHITE, glass), position=(1.4, 0, 0.5))
    stage.add(box((-0.3, 0, -0.3), (0.3, 1, 0.3)), position=(1.4, 0, 0))
    return framed(stage)


def blackout(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE)
    stage.brightness = 0.5
    stage.add(ball(), caption="half way")
    stage.draw(CAMERA, performer())
    return stage


def dense(context: moderngl.Context) -> Stage:
    stage = Stage(context, SIZE)
    stage.add(bumpy())
    return framed(stage, yaw=0.6)


def moved(context: moderngl.Context) -> Stage:
    """A character that was bent after it had been put on the stage."""
    stage = Stage(context, SIZE)
    rest = ring()
    character = stage.add(rest)
    character.update(rest.vertices + np.outer(rest.vertices[:, 1] ** 2, (0.5, 0.0, 0.2)))
    return framed(stage)


def floor(context: moderngl.Context) -> Stage:
    """Shadows, contact shadows and reflections."""
    stage = Stage(context, SIZE)
    stage.add(box((-0.3, 0, -0.3), (0.3, 1.3, 0.3)), position=(-0.5, 0, 0))
    stage.add(ball(BLUE, 0.6), position=(0.6, 0.1, 0.2))
    return framed(stage, yaw=-0.4, pitch=0.25)


SCENES: dict[str, Callable[[moderngl.Context], Stage]] = {
    scene.__name__: scene
    for scene in (
        single,
        captions,
        chains,
        inset,
        transparent,
        chroma,
        materials,
        blackout,
        dense,
        moved,
        floor,
    )
}


@pytest.fixture
def llvmpipe(context: moderngl.Context) -> moderngl.Context:
    """A context of the driver that drew the golden pictures."""
    if "llvmpipe" not in renderer_name(context):
        pytest.skip(f"golden pictures are compared on llvmpipe, not {renderer_name(context)}")
    return context


def drawn(scene: str, context: moderngl.Context) -> Picture:
    stage = SCENES[scene](context)
    picture = stage.read()
    stage.release()
    assert context.error == "GL_NO_ERROR"
    return picture


@pytest.mark.parametrize("scene", SCENES)
def test_golden(
    scene: str, llvmpipe: moderngl.Context, tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    picture = drawn(scene, llvmpipe)
    if pytestconfig.getoption("--regenerate-golden"):
        save_golden(scene, picture)
    assert_like_golden(scene, picture, tmp_path)


def test_golden_pictures_are_those_of_the_scenes_and_small() -> None:
    files = sorted(FOLDER.glob("*.png"))
    assert {path.stem for path in files} == set(SCENES)
    assert all(path.stat().st_size < 150_000 for path in files)


# -- What the pictures would notice ---------------------------------------------------------------

Break = Callable[[pytest.MonkeyPatch], None]


def without(owner: type, method: str) -> Break:
    """Let a method do nothing."""
    return lambda patch: patch.setattr(owner, method, lambda *_arguments, **_options: None)


def shader(name: str, text: str, instead: str) -> Break:
    """Change a piece of a shader."""

    def change(patch: pytest.MonkeyPatch) -> None:
        read = programs._read

        def changed(file: str) -> str:
            source = read(file)
            assert file != name or text in source, f"{name} has no {text!r}"
            return source.replace(text, instead) if file == name else source

        patch.setattr(programs, "_read", changed)

    return change


def without_shadows(patch: pytest.MonkeyPatch) -> None:
    """Let nothing into the shadow maps."""
    draw = ShadowMaps.draw
    patch.setattr(
        ShadowMaps,
        "draw",
        lambda maps, _characters, light, *, contact: draw(maps, [], light, contact=contact),
    )


def one_letter_off(patch: pytest.MonkeyPatch) -> None:
    """Spell captions with another letter."""
    draw = CaptionPainter.draw
    patch.setattr(
        CaptionPainter,
        "draw",
        lambda painter, text, at, target: draw(painter, text.replace("a", "o"), at, target),
    )


def without_movement(patch: pytest.MonkeyPatch) -> None:
    """Show the vertices that a character had first."""
    update = StageCharacter.update
    first: dict[StageCharacter, np.ndarray] = {}
    patch.setattr(
        StageCharacter,
        "update",
        lambda character, vertices: update(character, first.setdefault(character, vertices)),
    )


# What is broken: the scene that shows it, and the break. A shader's inputs must stay in use, or the
# driver drops them and the program refuses its buffers: hence the factors of one in a million.
FAULTS: dict[str, tuple[str, Break]] = {
    "no captions": ("captions", without(CaptionPainter, "draw")),
    "one letter of a caption": ("captions", one_letter_off),
    "no chains": ("chains", without(StageCharacter, "highlight")),
    "faint glow": (
        "chains",
        shader("tube.frag", "strength = colour.a", "strength = 0.5 * colour.a"),
    ),
    "no inset": ("inset", without(InsetPainter, "draw")),
    "no disc": ("inset", shader("inset_disc.frag", "alpha, alpha)", "alpha, alpha) * 1e-6")),
    "no shadows": ("single", without_shadows),
    "no contact shadows": ("floor", shader("floor.frag", "mix(0.06, 1.0, mask.g)", "1.0")),
    "no reflections": ("floor", without(StageCharacter, "draw_reflection")),
    "no key light": ("single", shader("character.frag", "KEY * soft", "0.0 * soft")),
    "no rim light": ("dense", shader("character.frag", "+ rim *", "+ 0.0 * rim *")),
    "no gloss": ("single", shader("character.frag", "+ lacquer", "")),
    "no pools of light": ("single", shader("backdrop.frag", "* 1.55 * lit", "* 0.0 * lit")),
    "no beams": ("single", shader("backdrop.frag", "* beams(", "* 0.0 * beams(")),
    "no stripes": ("single", shader("backdrop.frag", "* 3.0;", "* 0.0;")),
    "no texture": (
        "materials",
        shader("character.frag", "texture(image, uv);", "1e-6 * texture(image, uv) + 1.0;"),
    ),
    "no colours of vertices": (
        "chroma",
        shader("character.frag", "= colour * tint", "= (1e-6 * colour + 1.0) * tint"),
    ),
    "opaque glass": ("materials", shader("character.frag", "base.a);", "1.0);")),
    "a grey background": (
        "transparent",
        shader("resolved.frag", "xy), 0)", "xy), 0) + vec4(0.0, 0.0, 0.0, 0.1)"),
    ),
    "no blackout": ("blackout", without(Stage, "_fill")),
    "no movement": ("moved", without_movement),
    "flat normals": (
        "dense",
        shader("character.vert", "= in_normal", "= 1e-6 * in_normal + vec3(0.0, 1.0, 0.0)"),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_renderer_is_noticed(
    fault: str,
    llvmpipe: moderngl.Context,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene, break_it = FAULTS[fault]
    break_it(monkeypatch)
    with pytest.raises(AssertionError, match=f"^{scene}: ") as caught:
        assert_like_golden(scene, drawn(scene, llvmpipe), tmp_path)
    shown = re.search(r"difference: (.+\.png)$", str(caught.value))
    assert shown is not None
    assert Path(shown[1]).stat().st_size > 0


def test_roundings_of_a_driver_are_no_fault() -> None:
    """Every fourth pixel is off by one, one in each region by one of its four samples."""
    golden = golden_picture("single").astype(np.int64)
    other = golden.copy()
    other[::2, ::2, 0] ^= 1
    other[8::17, 8::17] += np.where(golden[8::17, 8::17] < 128, 64, -64)
    assert not Comparison.of(other.astype(np.uint8), golden.astype(np.uint8)).fault
