"""The widgets of the panel: buttons, switches and sliders that do actions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from imgui_bundle import ImVec2, ImVec4, imgui

from runtime.control.actions import ACTIONS, press, set_value
from runtime.control.keys import KEYS
from runtime.control.show_controls import ShowControls
from runtime.control.sliders import SLIDERS
from runtime.panel.gui import GOLD, LACQUER

Colour = tuple[float, float, float]

FIXED = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_nav
)
SMALL = 0.86  # times the height of usual letters
KEY_OF = {name: key for key, name in KEYS.items()}


@contextmanager
def card(
    name: str,
    left: float,
    top: float,
    width: float,
    height: float = 0.0,
    *,
    opacity: float = 0.84,
    most: float | None = None,
) -> Iterator[None]:
    """A window without a frame, at a place of the picture [px]; as high as it needs where 0.

    A negative `left` or `top` counts from the other side. One that would be higher than `most` [px]
    scrolls.
    """
    screen = imgui.get_io().display_size
    pivot = ImVec2(float(left < 0.0), float(top < 0.0))
    at = ImVec2(screen.x + left if left < 0.0 else left, screen.y + top if top < 0.0 else top)
    imgui.set_next_window_pos(at, imgui.Cond_.always, pivot)
    imgui.set_next_window_size(ImVec2(width, height))
    imgui.set_next_window_bg_alpha(opacity)
    flags = FIXED
    if most is not None:
        imgui.set_next_window_size_constraints(ImVec2(width, 0.0), ImVec2(width, max(most, 1.0)))
        flags &= ~imgui.WindowFlags_.no_scrollbar
    imgui.begin(name, None, flags)
    try:
        yield
    finally:
        imgui.end()


def button(
    name: str,
    controls: ShowControls,
    *,
    icon: str = "",
    label: str | None = None,
    lights: bool = True,
) -> None:
    """A button that presses an action; if it `lights`, it is lit while the action is on."""
    action = ACTIONS[name]
    lit = lights and action.read is not None and action.read(controls) >= 0.5
    if lit:
        imgui.push_style_color(imgui.Col_.button, ImVec4(*LACQUER, 0.9))
    words = " ".join(part for part in (icon, action.label if label is None else label) if part)
    if imgui.button(f"{words}##{name}"):
        press(name, controls)
    if lit:
        imgui.pop_style_color()
    hint(name)


def beside(words: str, gap: float = -1.0) -> None:
    """Put the next button, with these words on it, beside the last one, if it fits there."""
    style = imgui.get_style()
    between = style.item_spacing.x if gap < 0.0 else gap
    width = imgui.calc_text_size(words).x + 2.0 * style.frame_padding.x
    end = imgui.get_window_pos().x + imgui.get_window_size().x - style.window_padding.x
    if imgui.get_item_rect_max().x + between + width <= end:
        imgui.same_line(0.0, between)


def hint(name: str) -> None:
    """Show what the last widget does, and its key, while the mouse is over it."""
    if imgui.is_item_hovered():
        key = f"  [{KEY_OF[name]}]" if name in KEY_OF else ""
        imgui.set_tooltip(f"{ACTIONS[name].label}: {ACTIONS[name].text}{key}")


def fader(name: str, controls: ShowControls) -> None:
    """A slider that sets an action's value, with its number and what its ends mean."""
    action, slider = ACTIONS[name], SLIDERS[name]
    assert action.read is not None
    imgui.text(slider.words(controls))
    imgui.set_next_item_width(-1.0)
    before = action.read(controls)
    changed, value = imgui.slider_float(f"##{name}", before, 0.0, 1.0, "")
    if changed and value != before:
        set_value(name, value, controls)
    hint(name)
    with letters(SMALL):
        imgui.text_disabled(slider.hint)


def switch(name: str, controls: ShowControls) -> None:
    """A box that is ticked while the action is on."""
    action = ACTIONS[name]
    assert action.read is not None
    on = action.read(controls) >= 0.5
    padding = imgui.get_style().frame_padding
    imgui.push_style_var(imgui.StyleVar_.frame_padding, ImVec2(0.4 * padding.x, 0.4 * padding.y))
    changed, _ = imgui.checkbox(action.label, on)
    imgui.pop_style_var()
    if changed:
        press(name, controls)
    hint(name)


def dot(colour: Colour, radius: float) -> None:
    """A coloured dot at the height of a line of text; the next widget stands beside it."""
    at, line = imgui.get_cursor_screen_pos(), imgui.get_text_line_height()
    shade = imgui.get_color_u32(ImVec4(*colour, 1.0))
    middle = ImVec2(at.x + radius, at.y + line / 2.0)
    imgui.get_window_draw_list().add_circle_filled(middle, radius, shade)
    imgui.dummy(ImVec2(2.0 * radius, line))
    imgui.same_line()


def fitted(text: str, width: float) -> str:
    """A text that is cut at its end so that it is no wider than `width` [px]."""
    if imgui.calc_text_size(text).x <= width:
        return text
    while text and imgui.calc_text_size(f"{text}…").x > width:
        text = text[:-1]
    return f"{text}…"


@contextmanager
def letters(scale: float) -> Iterator[None]:
    """Text that is this many times as high as usual."""
    imgui.push_font(None, imgui.get_style().font_size_base * scale)
    try:
        yield
    finally:
        imgui.pop_font()


def heading(text: str) -> None:
    """A line that names what follows."""
    imgui.text_colored(ImVec4(*GOLD, 1.0), text)
