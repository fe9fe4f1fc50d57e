"""The column at the right edge: sliders and switches."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui

from runtime.conditioning.switches import SWITCHES
from runtime.control.actions import set_value
from runtime.control.count_in import MOST
from runtime.control.show_controls import ShowControls
from runtime.control.sliders import SLIDERS
from runtime.control.take_actions import count_in_words
from runtime.panel.widgets import card, fader, fitted, heading, hint, switch

WIDTH = 250.0  # [px] in a picture of the usual height
OF_CHARACTERS = ("in-place", "chains")


def draw_sliders(
    controls: ShowControls, margin: float, scale: float, top: float, above: float
) -> None:
    """Draw the column at the right, from `top` to `above` the lower border of the picture [px].

    It scrolls where there is too much.
    """
    most = imgui.get_io().display_size.y - above - top
    spacing = imgui.get_style().item_spacing
    imgui.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(spacing.x, 0.5 * spacing.y))
    with card("sliders", -margin, top, WIDTH * scale, most=most):
        heading(fitted(_whose(controls), imgui.get_content_region_avail().x))
        for name in SLIDERS:
            fader(name, controls)
        for name in OF_CHARACTERS:
            switch(name, controls)
        imgui.separator()
        heading("Takes")
        _draw_count_in(controls)
        imgui.separator()
        heading("Corrections of the performer")
        for name in SWITCHES:
            switch(name, controls)
    imgui.pop_style_var()


def _draw_count_in(controls: ShowControls) -> None:
    """How long the count-in is, in whole seconds."""
    seconds = round(controls.count_in.seconds)
    imgui.text(count_in_words(controls))
    imgui.set_next_item_width(-1.0)
    changed, value = imgui.slider_int("##count-in", seconds, 0, round(MOST), "")
    if changed and value != seconds:
        set_value("count-in", value / MOST, controls)
    hint("count-in")


def _whose(controls: ShowControls) -> str:
    """Whose sliders they are."""
    if len(controls.selected) == 1:
        return f"Character: {controls.selected[0].character.name}"
    return f"All {len(controls.selected)} characters"
