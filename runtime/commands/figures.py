"""`bunraku figures`: the paper's figures on squash and stretch, drawn from what our solvers do."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from runtime.cast import character_named
from runtime.character import Character
from runtime.figures import convergence
from runtime.figures.gallery import Exhibit, row_picture
from runtime.figures.plain import PlainSolver, volume
from runtime.figures.poses import Press, perform
from runtime.output.whole_file import check_writable, whole_file
from runtime.render.context import headless_context, release_headless
from solvers.arap import ArapSolver
from solvers.edges import unique_edges
from solvers.laplacian import Floats
from solvers.squash_stretch import SquashStretchSolver

if TYPE_CHECKING:
    import moderngl

POSES = {"squashed": (0.65, 0.0), "stretched": (1.35, 0.0), "leaning": (0.8, 0.7)}
_BALLOON_STEPS = 60
_CALM = 0.03  # a cell scaled by less is not squashed


def figures(options: argparse.Namespace) -> int:
    """Write figure-5.png, figure-6.png and figure-7.png; say in numbers what they show."""
    folder: Path = options.folder
    paths = [folder / f"figure-{number}.png" for number in (5, 6, 7)]
    characters = [character_named(name) for name in options.character or ["cactus"]]
    folder.mkdir(parents=True, exist_ok=True)
    for path in paths:
        check_writable(path)
    context = headless_context()
    try:
        rows = [_rigid_and_cartoon(context, one, options.size) for one in characters]
        _write(paths[0], np.concatenate(rows))
        rows = [_balloon(context, one, options.size) for one in characters]
        _write(paths[1], np.concatenate(rows))
    finally:
        release_headless(context)
    curves = convergence.measure()
    width = options.size[0]
    _write(paths[2], np.asarray(convergence.draw(curves, (width, 3 * width // 5))))
    print("\n".join(convergence.table(curves)))
    print("\n".join(str(path) for path in paths))
    return 0


def _rigid_and_cartoon(
    context: moderngl.Context, character: Character, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Figure 5: a character as it is, then rigid and as a cartoon, for each of the poses."""
    press = Press.on(character)
    exhibits = [Exhibit(character, character.vertices, press.handles, "at rest")]
    for pose, (ratio, lean) in POSES.items():
        for name, solver in _solvers(character, press).items():
            answer = perform(solver, press, ratio, lean)
            exhibits.append(Exhibit(character, answer, press.handles, f"{pose}, {name}"))
            kept = volume(answer, character.faces) / volume(character.vertices, character.faces)
            print(f"figure 5  {character.name}, {pose}, {name}: volume {kept:.1%}")
    return row_picture(context, exhibits, size)


def _solvers(character: Character, press: Press) -> dict[str, ArapSolver]:
    given: Any = (character.vertices, character.faces, press.handles)
    return {
        "rigid": ArapSolver(*given, groups=press.groups),
        "ours": SquashStretchSolver(*given, groups=press.groups),
    }


def _balloon(
    context: moderngl.Context, character: Character, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Figure 6: squashed under one constraint on the whole volume, and with ours, kept locally."""
    press = Press.on(character)
    ratio, lean = POSES["squashed"]
    solver = SquashStretchSolver(
        character.vertices, character.faces, press.handles, groups=press.groups
    )
    ours = perform(solver, press, ratio, lean)
    plain = PlainSolver(character.vertices, character.faces, press.handles)
    whole = character.vertices
    for step in range(_BALLOON_STEPS):
        share = min(2.0 * (step + 1) / _BALLOON_STEPS, 1.0)
        whole = whole.copy()
        whole[press.handles] = press.targets(1.0 + share * (ratio - 1.0), lean)
        whole = plain.whole_volume_step(whole)
    _say_swelling(character, solver, {"whole volume": whole, "ours": ours})
    exhibits = [
        Exhibit(character, character.vertices, press.handles, "at rest"),
        Exhibit(character, whole, press.handles, "whole volume kept"),
        Exhibit(character, ours, press.handles, "ours, kept locally"),
    ]
    return row_picture(context, exhibits, size)


def _say_swelling(
    character: Character, solver: SquashStretchSolver, answers: dict[str, Floats]
) -> None:
    """Say how much the parts that are not squashed grew, by the lengths of their edges."""
    edges = unique_edges(character.vertices, character.faces)
    calm = (abs(solver.scales - 1.0) < _CALM)[edges].all(axis=1)
    if not calm.any():
        return
    tails, heads = edges[calm].T
    rest = np.linalg.norm(character.vertices[tails] - character.vertices[heads], axis=1)
    for name, answer in answers.items():
        lengths = np.linalg.norm(answer[tails] - answer[heads], axis=1)
        change = float(np.mean(abs(lengths / rest - 1.0)))
        print(
            f"figure 6  {character.name}, {name}: volume "
            f"{volume(answer, character.faces) / volume(character.vertices, character.faces):.1%}, "
            f"edges of what is not squashed change by {change:.1%}"
        )


def _write(path: Path, pixels: NDArray[np.uint8]) -> None:
    with whole_file(path) as partial:
        Image.fromarray(pixels[..., :3]).save(partial, format="PNG", optimize=True)
