"""The card above the bar during mapping by hand: its buttons, and the delay within a group."""

from __future__ import annotations

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from runtime.control.actions import ACTIONS, set_value
from runtime.control.by_hand.choosing_actions import phase_words
from runtime.control.show_controls import ShowControls
from runtime.panel.widgets import beside, button, card, hint

PHASE = 110.0  # [px] width of the fader in a picture of the usual height
BUTTONS = {
    "accept": (icons.ICON_FA_CHECK, "Use these pairs"),
    "map-by-hand": (icons.ICON_FA_XMARK, "Leave"),
    "together": (icons.ICON_FA_CIRCLE_NODES, "All alike"),
    "clear-pairs": (icons.ICON_FA_ERASER, "No pairs"),
    "widest-view": (icons.ICON_FA_EXPAND, "Widest view"),
}


def draw_choosing(controls: ShowControls, margin: float, above: float, scale: float) -> float:
    """Draw the card `above` the lower border of the picture; return how high it is [px]."""
    screen = imgui.get_io().display_size
    with card("choosing", margin, -above, screen.x - 2.0 * margin):
        for number, (name, (icon, label)) in enumerate(BUTTONS.items()):
            if number:
                beside(f"{icon} {label}")
            button(name, controls, icon=icon, label=label, lights=name == "together")
        words = phase_words(controls)
        beside(words + "m" * 8)
        imgui.align_text_to_frame_padding()
        imgui.text_disabled(words)
        imgui.same_line()
        _draw_phase(controls, scale)
        height: float = imgui.get_window_size().y
    return height + margin


def _draw_phase(controls: ShowControls, scale: float) -> None:
    action = ACTIONS["phase"]
    assert action.read is not None
    before = action.read(controls)
    imgui.set_next_item_width(PHASE * scale)
    changed, value = imgui.slider_float("##phase", before, 0.0, 1.0, "")
    if changed and value != before:
        set_value("phase", value, controls)
    hint("phase")
