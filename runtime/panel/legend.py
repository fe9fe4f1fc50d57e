"""The legend below the performer's small picture: what drives what, in its colours."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from runtime.control.show_controls import ShowControls
from runtime.panel.widgets import Colour, card, dot, fitted
from runtime.render.tubes import PAIR_COLOURS
from runtime.status.show_status import CharacterStatus, ShowStatus

WIDTH = 236.0  # [px] in a picture of the usual height
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
        for number, character in enumerate(status.characters):
            _draw_name(number, status, controls)
            if number == (controls.match_controls.selected or 0):
                _draw_parts(character, scale)


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


def _draw_parts(character: CharacterStatus, scale: float) -> None:
    imgui.indent()
    if not character.parts:
        imgui.text_disabled("nothing yet")
    for part, (source, target, way) in enumerate(_rows(character)):
        dot(_encoded(part), 5.0 * scale)
        imgui.text(source)
        imgui.same_line(0.0, 5.0 * scale)
        imgui.text_disabled("to")
        imgui.same_line(0.0, 5.0 * scale)
        imgui.text(fitted(target, imgui.get_content_region_avail().x))
        if way:
            imgui.same_line()
            imgui.text_disabled(way)
    imgui.unindent()
    imgui.dummy(ImVec2(0.0, 2.0 * scale))


def _rows(character: CharacterStatus) -> list[tuple[str, str, str]]:
    """Source, target and share of each part, where it is not whole."""
    return [
        (part.name, part.target_name, "" if part.gain > FULL_GAIN else f"{100 * part.gain:.0f} %")
        for part in character.parts
    ]


def _encoded(part: int) -> Colour:
    """The colour of a pair, encoded sRGB."""
    red, green, blue = PAIR_COLOURS[part % len(PAIR_COLOURS)] ** (1.0 / 2.2)
    return float(red), float(green), float(blue)
