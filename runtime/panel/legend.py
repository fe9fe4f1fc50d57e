"""The legend below the performer's small picture: what drives what, in the colours on the stage."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from imgui_bundle import ImVec2, imgui

from runtime.control.show_controls import ShowControls
from runtime.driving.driver import ABSOLUTE, RELATIVE, DrivenPart
from runtime.panel.widgets import SMALL, Colour, card, dot, fitted, letters
from runtime.render.tubes import PAIR_COLOURS
from runtime.show.lights import colour_numbers
from runtime.status.show_status import CharacterStatus, ShowStatus

WIDTH = 262.0  # [px] in a picture of the usual height
WAYS = {
    ABSOLUTE: "absolute: points where yours points",
    RELATIVE: "relative: turns as yours turns",
}
FULL_GAIN = 0.995  # from which a gain is not worth a word


def draw_legend(
    status: ShowStatus,
    controls: ShowControls,
    margin: float,
    scale: float,
    top: float,
    above: float,
) -> None:
    """Draw the legend between `top` and `above` the lower border of the picture, both [px].

    It lists the parts of the selected character, or of the first, and the names of the others; a
    click on a name selects that character. It scrolls where there are too many.
    """
    top = max(top, margin)
    most = imgui.get_io().display_size.y - above - top
    with card("legend", margin, top, WIDTH * scale, opacity=0.55, most=most):
        colours = _colours(status.characters)
        for number, character in enumerate(status.characters):
            _draw_name(number, status, controls)
            if number == (controls.match_controls.selected or 0):
                _draw_parts(character, colours[number], scale)


def _draw_name(number: int, status: ShowStatus, controls: ShowControls) -> None:
    """The name of a character; where there are several, a click selects it, or all again."""
    name = fitted(status.characters[number].name, imgui.get_content_region_avail().x)
    if len(status.characters) == 1:
        imgui.text(name)
        return
    selected = controls.match_controls.selected == number
    pressed, _ = imgui.selectable(f"{name}##{number}", selected)
    if selected and not imgui.is_item_visible():
        imgui.set_scroll_here_y()
    if pressed:
        controls.select(None if selected else number)


def _colours(characters: Sequence[CharacterStatus]) -> list[list[int]]:
    """The number of the colour of each character's parts: one for a part of the performer."""
    numbers = iter(colour_numbers([part.source[1:] for one in characters for part in one.parts]))
    return [list(itertools.islice(numbers, len(one.parts))) for one in characters]


def _draw_parts(character: CharacterStatus, colours: Sequence[int], scale: float) -> None:
    imgui.indent()
    with letters(SMALL):
        imgui.text_disabled(_way(character.parts))
    for number, part in enumerate(character.parts):
        imgui.begin_group()
        dot(_encoded(colours[number]), 5.0 * scale)
        _draw_pair(part, scale)
        imgui.end_group()
        if imgui.is_item_hovered():
            imgui.set_tooltip(str(part))
    imgui.unindent()
    imgui.dummy(ImVec2(0.0, 2.0 * scale))


def _draw_pair(part: DrivenPart, scale: float) -> None:
    """What drives what, and how much of it where that is not all; shortened to its line."""
    share = "" if part.gain > FULL_GAIN else f"{100.0 * part.gain:.0f} %"
    gap = 5.0 * scale
    room = imgui.get_content_region_avail().x
    room -= imgui.calc_text_size(f"{part.name}to{share}").x + 2.0 * gap + (gap if share else 0.0)
    whole, short = part.target_name, part.target_name.partition(",")[0]
    target = fitted(whole if imgui.calc_text_size(whole).x <= room else short, room)
    imgui.text(part.name)
    for words, quiet in (("to", True), (target, False), (share, True)):
        if words:
            imgui.same_line(0.0, gap)
            (imgui.text_disabled if quiet else imgui.text)(words)


def _way(parts: Sequence[DrivenPart]) -> str:
    """How parts follow, in a few words."""
    drives = {part.drive for part in parts}
    if not drives:
        return "follows nothing yet"
    if len(drives) > 1:
        return "some absolute, some relative"
    return WAYS[drives.pop()]


def _encoded(part: int) -> Colour:
    """The colour of a pair, encoded sRGB."""
    red, green, blue = PAIR_COLOURS[part % len(PAIR_COLOURS)] ** (1.0 / 2.2)
    return float(red), float(green), float(blue)
