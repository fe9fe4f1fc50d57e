"""Figures 5, 6 and 7 of the paper on squash and stretch, drawn with our own solvers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from runtime.characters.character import Character
from runtime.figures import convergence
from runtime.figures.bird import BIRD, bird, tail_volume
from runtime.figures.gallery import Exhibit, Gallery
from runtime.figures.plain import PlainSolver, volume
from runtime.figures.poses import Press, perform
from runtime.output.files.whole_file import check_writable, whole_file
from solvers.arap import ArapSolver
from solvers.linear.laplacian import Floats
from solvers.squash_stretch import SquashStretchSolver

POSES = {"squashed": (0.65, 0.0), "stretched": (1.35, 0.0), "leaning": (0.8, 0.7)}
_BALLOON_STEPS = 40


def draw_figures(
    folder: Path, characters: Sequence[Character], size: tuple[int, int]
) -> Iterator[str]:
    """Write figure-5.png, figure-6.png and figure-7.png.

    Args:
        folder: for the pictures; made if it is not there.
        characters: a row of figures 5 and 6 for each.
        size: width and height of a row [px].

    Yields:
        Lines with the figures in numbers, then the names of the files.

    Raises:
        InputError: a file cannot be written.
    """
    paths = [folder / f"figure-{number}.png" for number in (5, 6, 7)]
    folder.mkdir(parents=True, exist_ok=True)
    for path in paths:
        check_writable(path)
    lines: list[str] = []
    with Gallery(size) as gallery:
        rows = [_rigid_and_cartoon(gallery, character, lines) for character in characters]
        _write(paths[0], np.concatenate(rows))
        rows = [_balloon(gallery, character, lines) for character in [bird(), *characters]]
        _write(paths[1], np.concatenate(rows))
    yield from lines
    curves = convergence.measure()
    width = size[0]
    _write(paths[2], np.asarray(convergence.draw(curves, (width, 3 * width // 5))))
    yield from convergence.table(curves)
    yield from map(str, paths)


def _rigid_and_cartoon(
    gallery: Gallery, character: Character, lines: list[str]
) -> NDArray[np.uint8]:
    """Figure 5: a character as it is, then rigid and as a cartoon, for each of the poses."""
    press = Press.on(character)
    exhibits = [Exhibit(character, character.vertices, press.handles, "at rest")]
    for pose, (ratio, lean) in POSES.items():
        for name, solver in _solvers(character, press).items():
            answer = perform(solver, press, ratio, lean)
            exhibits.append(Exhibit(character, answer, press.handles, f"{pose}, {name}"))
            lines.append(f"figure 5  {character.name}, {pose}, {name}: {_kept(answer, character)}")
    return gallery.row(exhibits)


def _solvers(character: Character, press: Press) -> dict[str, ArapSolver]:
    given: Any = (character.vertices, character.faces, press.handles)
    return {
        "rigid": ArapSolver(*given, groups=press.groups),
        "ours": SquashStretchSolver(*given, groups=press.groups),
    }


def _balloon(gallery: Gallery, character: Character, lines: list[str]) -> NDArray[np.uint8]:
    """Figure 6: squashed under one constraint on the whole volume, and with ours, kept locally."""
    press = Press.on(character)
    ratio, lean = POSES["squashed"]
    ours = perform(_solvers(character, press)["ours"], press, ratio, lean)
    plain = PlainSolver(character.vertices, character.faces, press.handles)
    whole = character.vertices
    for share in np.clip(np.linspace(0.0, 2.0, _BALLOON_STEPS), 0.0, 1.0):
        whole = whole.copy()
        whole[press.handles] = press.targets(1.0 + share * (ratio - 1.0), lean)
        whole = plain.whole_volume_step(whole)
    exhibits = [Exhibit(character, character.vertices, press.handles, "at rest")]
    for name, answer in {"whole volume kept": whole, "ours, kept locally": ours}.items():
        kept = _kept(answer, character)
        if character.name == BIRD:
            tail = tail_volume(answer, character) / tail_volume(character.vertices, character)
            kept += f", of its tail {tail:.1%}"
        lines.append(f"figure 6  {character.name}, {name}: {kept}")
        exhibits.append(Exhibit(character, answer, press.handles, name))
    return gallery.row(exhibits)


def _kept(answer: Floats, character: Character) -> str:
    """In words, the volume at an answer (N, 3) as a share of that at rest."""
    rest = volume(character.vertices, character.faces)
    if abs(rest) < 1e-9:
        return "no volume to keep"
    return f"volume {volume(answer, character.faces) / rest:.1%}"


def _write(path: Path, pixels: NDArray[np.uint8]) -> None:
    with whole_file(path) as partial:
        Image.fromarray(pixels[..., :3]).save(partial, format="PNG", optimize=True)
