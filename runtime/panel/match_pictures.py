"""Small pictures of the best matches: the chains of performer and character, alike in colour."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from numpy.typing import NDArray

from runtime.control.actions import press
from runtime.control.show_controls import ShowControls
from runtime.driving.mapping import Mapping
from runtime.panel.gui import GOLD, PAPER
from runtime.panel.widgets import SMALL, card, hint, letters
from runtime.render.inset import body_bones
from runtime.render.tubes import PAIR_COLOURS
from runtime.show.lights import colour_numbers
from runtime.status.show_status import ShowStatus

SIZE = (150.0, 84.0)  # [px] of a picture, in a window of the usual height
PLACES = {"performer": (0.08, 0.40), "character": (0.48, 0.94)}  # of its width, from left to right
FILLED = 0.82  # of its height
BONE, CHAIN = 2.0, 4.0  # [px] widths of lines, likewise

Array = NDArray[np.float64]
Line = list[Any]


@dataclass(frozen=True, slots=True)
class _Figure:
    """Lines in a picture, right and down from its middle in [px].

    Attributes:
        bones: all that there is.
        chains: those of the match.
    """

    bones: Sequence[Array]
    chains: Sequence[Array]


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """What does not change of a performer and a character.

    Attributes:
        shown: (J,) the joints that are drawn.
        of_performer, of_character: the joints or nodes of each line along bones.
    """

    shown: NDArray[np.bool]
    of_performer: Sequence[list[int]]
    of_character: Sequence[list[int]]


class MatchPictures:
    """Draws the best matches on a card of their own while one is looked for; a click takes one.

    One of them is laid out anew in each picture of the window, each in its turn.

    Attributes:
        left: where the card begins, from the left of the picture [px].
    """

    def __init__(self) -> None:
        self.left = math.inf
        self._of: ShowStatus | None = None
        self._pictures: list[tuple[_Figure, _Figure]] = []
        self._colours: list[list[int]] = []
        self._shown: int | None = None
        self._whose = ""
        self._behind = False
        self._turn = 0  # the picture that was laid out last, from 1
        self._bodies: dict[int, _Body] = {}
        self._drawn: dict[int, tuple[tuple[float, float], list[tuple[Line, int, float]]]] = {}

    def draw(
        self,
        status: ShowStatus,
        controls: ShowControls,
        margin: float,
        above: float,
        scale: float,
    ) -> float:
        """Draw the card `above` the lower border; return how high it is, 0 without one [px]."""
        fresh, self._of = status is not self._of, status
        if self._behind or (fresh and not self._pictures):
            self._look(status, controls, scale)
        self._behind = fresh
        if not self._pictures:
            self.left = math.inf
            return 0.0
        style = imgui.get_style()
        across = len(self._pictures) * (SIZE[0] * scale + style.item_spacing.x)
        width = across - style.item_spacing.x + 2.0 * style.window_padding.x
        self.left = max((imgui.get_io().display_size.x - width) / 2.0, margin)
        with card("matches", self.left, -above, width):
            with letters(SMALL):
                count = len(self._pictures)
                imgui.text_disabled(f"Best matches{self._whose}: click one, or press 1 to {count}")
            self._turn = self._turn % count + 1
            for rank in range(1, count + 1):
                if rank > 1:
                    imgui.same_line()
                self._draw_one(rank, controls, scale, anew=rank == self._turn)
            height: float = imgui.get_window_size().y
        return height + margin

    def _look(self, status: ShowStatus, controls: ShowControls, scale: float) -> None:
        """Make the pictures of the character whose match the arrows step through."""
        matching, self._pictures = controls.match_controls, []
        selected = matching.selected
        numbers = range(len(status.characters)) if selected is None else [selected]
        if controls.chooser.on:
            return
        for number in numbers:
            match = matching.matches[number]
            if mappings := match.best:
                name = f" for {status.characters[number].name}"
                self._whose = name if len(status.characters) > 1 else ""
                self._picture(number, mappings, controls, scale)
                self._paint(mappings, status)
                drives = match.mapping.drives
                shown = (rank for rank, each in enumerate(mappings) if each.drives == drives)
                self._shown = next(shown, None)
                return

    def _picture(
        self, number: int, mappings: Sequence[Mapping], controls: ShowControls, scale: float
    ) -> None:
        performer = controls.match_controls.performer_of(number)
        tree = controls.puppets[number].bound_skeleton.tree
        pose = performer.pose
        if pose is None:
            return
        if number not in self._bodies:
            parents, shown = body_bones(performer.skeleton)
            self._bodies[number] = _Body(shown, _ways(parents), _ways(tree.parents))
        body = self._bodies[number]
        joints = np.where(body.shown[:, None], pose.seen[:, :2], np.nan)
        view = np.eye(3) if controls.scene is None else controls.scene.camera.view_rotation
        left = _placed(joints, "performer", scale)
        right = _placed((tree.positions @ view.T)[:, :2], "character", scale)
        of_performer = [left[way] for way in body.of_performer]
        of_character = [right[way] for way in body.of_character]
        for mapping in mappings:
            chains = [(left[list(d.source)], right[list(d.target)]) for d in mapping.drives]
            self._pictures.append(
                (
                    _Figure(of_performer, [source for source, _ in chains]),
                    _Figure(of_character, [target for _, target in chains]),
                )
            )

    def _paint(self, mappings: Sequence[Mapping], status: ShowStatus) -> None:
        """Give each part of the performer one colour: that which it has on the stage, if any."""
        lit = [part.source[1:] for one in status.characters for part in one.parts]
        drives = [drive.source[1:] for mapping in mappings for drive in mapping.drives]
        numbers = iter(colour_numbers([*lit, *drives])[len(lit) :])
        self._colours = [list(itertools.islice(numbers, len(each.drives))) for each in mappings]

    def _draw_one(self, rank: int, controls: ShowControls, scale: float, *, anew: bool) -> None:
        size = ImVec2(SIZE[0] * scale, SIZE[1] * scale)
        at = imgui.get_cursor_screen_pos()
        if imgui.invisible_button(f"match-{rank}", size):
            press(f"match-{rank}", controls)
        hint(f"match-{rank}")
        end = ImVec2(at.x + size.x, at.y + size.y)
        paint, rounding = imgui.get_window_draw_list(), 6.0 * scale
        ground = 0.16 if imgui.is_item_hovered() else 0.07
        paint.add_rect_filled(at, end, _shade(PAPER, ground), rounding)
        if anew or rank not in self._drawn or self._drawn[rank][0] != (at.x, at.y):
            middle = np.array([at.x + size.x / 2.0, at.y + size.y / 2.0])
            self._drawn[rank] = (at.x, at.y), self._lines(rank, middle, scale)
        for line, shade, width in self._drawn[rank][1]:
            paint.add_polyline(line, shade, width, 0)
        if rank - 1 == self._shown:
            paint.add_rect(at, end, _shade(GOLD, 1.0), rounding, 2.5 * scale)
        corner = ImVec2(at.x + 6.0 * scale, at.y + 3.0 * scale)
        with letters(SMALL):
            paint.add_text(corner, _shade(GOLD, 1.0), str(rank))

    def _lines(self, rank: int, middle: Array, scale: float) -> list[tuple[Line, int, float]]:
        """The lines of a picture around its middle [px], with colour and width: chains on top."""
        faint, lines = _shade(PAPER, 0.35), []
        for figure in self._pictures[rank - 1]:
            lines += [(_line(bone + middle), faint, BONE * scale) for bone in figure.bones]
            for chain, colour in zip(figure.chains, self._colours[rank - 1], strict=True):
                lines.append((_line(chain + middle), _shade(_encoded(colour), 1.0), CHAIN * scale))
        return lines


def _placed(points: Array, who: str, scale: float) -> Array:
    """Points (K, 2) [m], x right and y up, at their place of a picture: right and down [px]."""
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    begins, ends = PLACES[who]
    room = scale * np.array([(ends - begins) * SIZE[0], FILLED * SIZE[1]])
    factor = float(np.min(room / np.maximum(high - low, 1e-6)))
    placed: Array = (points - (low + high) / 2.0) * (factor, -factor)
    placed[:, 0] += scale * SIZE[0] * ((begins + ends) / 2.0 - 0.5)
    return placed


def _ways(parents: NDArray[np.int64]) -> list[list[int]]:
    """The bones of a figure in as few lines as there are tips: each ends where one was drawn."""
    inner = set(parents.tolist())
    drawn: set[int] = set()
    lines = []
    for tip in (node for node in range(len(parents)) if node not in inner):
        line, node = [tip], tip
        while node not in drawn and parents[node] >= 0:
            drawn.add(node)
            node = int(parents[node])
            line.append(node)
        lines.append(line)
    return lines


def _line(points: Array) -> Line:
    """Points (k, 2) [px] that are known, as ImGui takes them."""
    return [ImVec2(x, y) for x, y in points[np.isfinite(points[:, 0])].tolist()]


def _encoded(colour: int) -> tuple[float, float, float]:
    red, green, blue = PAIR_COLOURS[colour % len(PAIR_COLOURS)] ** (1.0 / 2.2)
    return float(red), float(green), float(blue)


def _shade(colour: tuple[float, float, float], opacity: float) -> int:
    return int(imgui.get_color_u32(ImVec4(*colour, opacity)))
