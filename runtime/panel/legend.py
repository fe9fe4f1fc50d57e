"""The legend below the performer's small picture: what drives what, in its colours."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from runtime.control.show_controls import ShowControls
from runtime.panel.widgets import Colour, card, dot
from runtime.render.tubes import PAIR_COLOURS
from runtime.status.show_status import CharacterStatus, ShowStatus

WIDTH = 236.0  # [px] in a picture of the usual height
FULL_GAIN = 0.995  # from which a gain is not worth a word


def draw_legend(
    status: ShowStatus, controls: ShowControls, margin: float, scale: float, top: float
) -> None:
    """Draw the legend from `top` [px] on; a character's name in it selects that character."""
    with card("legend", margin, max(top, margin), WIDTH * scale, opacity=0.55):
        for number, character in enumerate(status.characters):
            _draw_character(number, character, controls, scale)


def _draw_character(
    number: int, character: CharacterStatus, controls: ShowControls, scale: float
) -> None:
    """The name of a character, which a click selects, and its parts below it."""
    several = len(controls.puppets) > 1
    selected = several and controls.match_controls.selected == number
    if several:
        pressed, _ = imgui.selectable(f"{character.name}##{number}", selected)
        if pressed:
            controls.select(None if selected else number)
    else:
        imgui.text(character.name)
    imgui.indent()
    if not character.parts:
        imgui.text_disabled("nothing yet")
    for part, (source, target, way) in enumerate(_rows(character)):
        dot(_encoded(part), 5.0 * scale)
        imgui.text(source)
        imgui.same_line(0.0, 5.0 * scale)
        imgui.text_disabled("to")
        imgui.same_line(0.0, 5.0 * scale)
        imgui.text(target)
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
