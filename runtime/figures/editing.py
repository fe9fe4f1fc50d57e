"""Figures 6, 7, 8 and 13 of AniMesh on editing, drawn with our own edits of animated parts.

Each panel shows one state of the same shapes, made from the panel before it by one edit. Moments
before the last one are paler. Figures 9 and 10, with surfaces, are not among them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from runtime.output.files.whole_file import check_writable, whole_file
from solvers.editing.clips_on_chains import LaidClip, parameters_at, with_clip
from solvers.editing.cutting import cut
from solvers.editing.merging import merged
from solvers.editing.motion import UNTURNED, Clip, Motion
from solvers.editing.nodes import with_node, without_node
from solvers.editing.part import Part, part_of
from solvers.editing.part_pose import pose_at
from solvers.editing.placing import moved, turned

_TIMES = (0.0, 0.33, 0.66, 1.0)
_PAPER, _INK = (255, 255, 255), (40, 44, 52)
_COLOURS = ((222, 120, 44), (44, 130, 190))
_FINER = 2  # drawn so much larger, for smooth edges
_HALF_TURN = (0.0, 0.0, 1.0, 0.0)


class Panel(NamedTuple):
    """One picture of a figure.

    Attributes:
        label: below it.
        parts: what is shown.
        times: [s] of the moments, the last one is drawn full.
    """

    label: str
    parts: tuple[Part, ...]
    times: tuple[float, ...] = _TIMES


def draw_editing(folder: Path, size: tuple[int, int]) -> list[str]:
    """Write figure-6.png, figure-7.png, figure-8.png and figure-13.png.

    Args:
        folder: for the pictures; made if it is not there.
        size: width and height of a row of three panels [px].

    Returns:
        The names of the files.

    Raises:
        InputError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    figures = {6: figure_6(), 7: figure_7(), 8: figure_8(), 13: figure_13()}
    paths = {number: folder / f"figure-{number}.png" for number in figures}
    for path in paths.values():
        check_writable(path)
    for number, panels in figures.items():
        with whole_file(paths[number]) as partial:
            _sheet(panels, size).save(partial, format="PNG", optimize=True)
    return [str(path) for path in paths.values()]


def figure_6() -> list[Panel]:
    """The editing sequence, from one bone that turns by 90 degrees to an edited shape of seven."""
    first = with_clip(_chain(1), (0, 1), LaidClip(_turning(90.0), 0.0, 1.0))
    three = with_node(with_node(first, 1, 1.0 / 3.0), 1, 0.5)
    copy = moved(turned(three, _HALF_TURN, (0.0, 0.0, 0.0)), (-0.6, 0.0, 0.0))
    whole = merged(three, moved(copy, (0.6, 0.0, 0.0)), three.root.id, 1.0)
    kept, off = cut(whole, three.nodes[-2].id, 0.5, 1.0)
    there = pose_at(kept, 1.0).position(kept.root.id) - np.array(off.place)
    placed = moved(off, (float(there[0]), float(there[1]), float(there[2])))
    joined = merged(kept, placed, kept.root.id, 1.0)
    now = (1.0,)
    return [
        Panel("a: one bone turns by 90 degrees", (first,)),
        Panel("b: two nodes more", (three,)),
        Panel("c: a copy, turned by 180 degrees", (three, copy)),
        Panel("d: both merged", (whole,)),
        Panel("e: to be cut", (whole,), now),
        Panel("f: cut in two", (kept, moved(off, (0.0, 0.35, 0.0))), now),
        Panel("g: at another node", (kept, moved(placed, (0.0, 0.25, 0.0))), now),
        Panel("h: merged", (joined,), now),
        Panel("i: with all of its motion", (joined,)),
    ]


def figure_7() -> list[Panel]:
    """A bone is cut in the midst of its motion, and nothing jumps."""
    whole = with_clip(_chain(2), (0, 1, 2), LaidClip(_turning(80.0), 0.0, 1.0))
    kept, off = cut(whole, 2, 0.5, 0.66)
    return [
        Panel("a: before the cut", (whole,), (0.0, 0.66)),
        Panel("b: cut at 0.66 s", (kept, off), (0.66,)),
        Panel("c: both go on", (kept, moved(off, (0.15, 0.15, 0.0)))),
    ]


def figure_8() -> list[Panel]:
    """A part is merged onto another in the midst of its motion, and nothing jumps."""
    base = with_clip(_chain(2), (0, 1, 2), LaidClip(_turning(-40.0), 0.0, 1.0))
    graft = with_clip(_chain(1), (0, 1), LaidClip(_turning(90.0), 0.0, 1.0))
    end = pose_at(base, 0.66).position(2)
    placed = moved(graft, (float(end[0]), float(end[1]), 0.0))
    whole = merged(base, placed, 2, 0.66)
    return [
        Panel("a: two parts", (base, moved(placed, (0.0, 0.3, 0.0))), (0.0, 0.66)),
        Panel("b: merged at 0.66 s", (whole,), (0.66,)),
        Panel("c: both motions go on", (whole,)),
    ]


def figure_13() -> list[Panel]:
    """Two motions meet at a node; where the paper loses both, they stay when the node goes."""
    first = with_clip(_chain(1), (0, 1), LaidClip(_turning(60.0), 0.0, 0.6))
    other = with_clip(_chain(1), (0, 1), LaidClip(_turning(-90.0), 0.3, 1.0))
    end = pose_at(first, 0.0).position(1)
    whole = merged(first, moved(other, (float(end[0]), float(end[1]), 0.0)), 1, 0.0)
    pairs = " and ".join(f"{s:.1f}" for _, s in parameters_at(whole, 1))
    gone = without_node(whole, 1)
    again = with_node(gone, gone.nodes[-1].id, 0.5)
    return [
        Panel(f"a: s = {pairs} at the node", (whole,)),
        Panel("b: the node is removed", (gone,)),
        Panel("c: added again, it parts them", (again,)),
    ]


def _chain(bones: int) -> Part:
    """Bones along x, of length 1 together."""
    x = np.linspace(0.0, 1.0, bones + 1)
    return part_of(np.stack([x, 0.0 * x, 0.0 * x], axis=1), np.arange(bones + 1) - 1)


def _turning(degrees: float) -> Clip:
    """Along its polyline, a turn about z that grows within a second."""
    half = 0.5 * np.radians(degrees)
    turn = np.array([0.0, 0.0, np.sin(half), np.cos(half)])
    still = np.array(UNTURNED)
    frames = np.stack([np.stack([still, still]), np.stack([still, turn])])
    return Clip(Motion(np.array([0.0, 1.0]), np.array([0.0, 1.0]), frames))


def _sheet(panels: Sequence[Panel], size: tuple[int, int]) -> Image.Image:
    """The panels in rows of three, all at one scale."""
    rows = (len(panels) + 2) // 3
    width, height = _FINER * size[0], _FINER * size[1] * rows
    picture = Image.new("RGB", (width, height), _PAPER)
    points = np.concatenate([_points(panel.parts, panel.times) for panel in panels])
    low, high = points.min(axis=0) - 0.15, points.max(axis=0) + 0.15
    cell = np.array([width / 3.0, height / rows])
    letters = max(min(cell[1] / 14.0, cell[0] / 22.0), 8.0)
    font = ImageFont.load_default(letters)
    room = cell - np.array([0.0, 2.0 * letters])
    scale = float((room / (high - low)).min())
    for number, panel in enumerate(panels):
        corner = cell * np.array([number % 3, number // 3])
        middle = corner + 0.5 * room
        _draw(picture, panel, scale, middle, 0.5 * (low + high))
        place = (corner[0] + 0.5 * cell[0], corner[1] + cell[1] - letters)
        ImageDraw.Draw(picture).text(place, panel.label, fill=_INK, font=font, anchor="mm")
    return picture.resize((size[0], size[1] * rows), Image.Resampling.LANCZOS)


def _points(parts: Iterable[Part], times: Iterable[float]) -> NDArray[np.float64]:
    moments = list(times)
    return np.concatenate(
        [pose_at(part, time).positions[:, :2] for part in parts for time in moments]
    )


def _draw(
    picture: Image.Image,
    panel: Panel,
    scale: float,
    middle: NDArray[np.float64],
    centre: NDArray[np.float64],
) -> None:
    pen = ImageDraw.Draw(picture)
    thick = max(int(0.13 * scale), 2)
    for time in panel.times:
        share = 1.0 if time == panel.times[-1] else 0.25 + 0.3 * time
        for part, colour in zip(panel.parts, _COLOURS, strict=False):
            pose = pose_at(part, time)
            at = middle + scale * (pose.positions[:, :2] - centre) * np.array([1.0, -1.0])
            shown = tuple(round(share * c + (1.0 - share) * 255) for c in colour)
            dark = tuple(round(share * c + (1.0 - share) * 255) for c in _INK)
            for node in part.nodes[1:]:
                ends = [tuple(at[part.index[each]]) for each in (node.parent, node.id)]
                pen.line(ends, fill=shown, width=thick)
            for x, y in at:
                pen.ellipse((x - thick / 2, y - thick / 2, x + thick / 2, y + thick / 2), shown)
            for x, y in at:
                pen.ellipse((x - thick / 6, y - thick / 6, x + thick / 6, y + thick / 6), dark)
