"""The bar along the lower border: the buttons, and the line of time of a recording."""

from __future__ import annotations

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from runtime.control.show_controls import ShowControls
from runtime.panel.status_card import clock
from runtime.panel.widgets import button, card
from runtime.status.prompts import place_of_match
from runtime.status.show_status import PlaybackStatus, ShowStatus


def draw_bar(status: ShowStatus, controls: ShowControls, margin: float, scale: float) -> float:
    """Draw the bar; return how high it is with its margin [px]."""
    screen = imgui.get_io().display_size
    with card("bar", margin, -margin, screen.x - 2.0 * margin):
        if status.playback is not None and status.session is None:
            _draw_playback(status.playback, controls, scale)
            imgui.same_line()
        button("record", controls, icon=icons.ICON_FA_CIRCLE)
        for name, icon in (
            ("freeze", icons.ICON_FA_SNOWFLAKE),
            ("blackout", icons.ICON_FA_MOON),
        ):
            imgui.same_line()
            button(name, controls, icon=icon)
        imgui.same_line(0.0, 24.0 * scale)
        _draw_matching(status, controls)
        _draw_right(controls)
        height: float = imgui.get_window_size().y
    return height + 2.0 * margin


def _draw_playback(playback: PlaybackStatus, controls: ShowControls, scale: float) -> None:
    button("home", controls, icon=icons.ICON_FA_BACKWARD_STEP, label="")
    imgui.same_line()
    icon = icons.ICON_FA_PLAY if playback.paused else icons.ICON_FA_PAUSE
    button("hold", controls, icon=icon, label="", lights=False)
    imgui.same_line()
    imgui.set_next_item_width(220.0 * scale)
    words = f"{clock(playback.position)} / {clock(playback.duration)}"
    changed, moment = imgui.slider_float(
        "##time", playback.position, 0.0, max(playback.duration, 1e-6), words
    )
    if changed and controls.playback is not None:
        controls.playback.seek(min(max(moment, 0.0), playback.duration))


def _draw_matching(status: ShowStatus, controls: ShowControls) -> None:
    button("match-again", controls, icon=icons.ICON_FA_PERSON_RAYS)
    words = place_of_match(status, controls.match_controls.selected)
    if words:
        imgui.same_line()
        button("previous-match", controls, icon=icons.ICON_FA_CHEVRON_LEFT, label="")
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text(words)
        imgui.same_line()
        button("next-match", controls, icon=icons.ICON_FA_CHEVRON_RIGHT, label="")
    if status.matching:
        imgui.same_line()
        button("accept", controls, icon=icons.ICON_FA_CHECK)
        if any(each.performing for each in status.characters if each.matching):
            imgui.same_line()
            button("keep-match", controls, icon=icons.ICON_FA_ROTATE_LEFT)


def _draw_right(controls: ShowControls) -> None:
    """The buttons of the window itself, at the right end of the bar."""
    names = (
        ("sliders", icons.ICON_FA_SLIDERS),
        ("full-screen", icons.ICON_FA_EXPAND),
        ("panel", icons.ICON_FA_EYE_SLASH),
        ("help", icons.ICON_FA_CIRCLE_QUESTION),
    )
    style = imgui.get_style()
    widths = [
        imgui.calc_text_size(icon).x + 2.0 * style.frame_padding.x + style.item_spacing.x
        for _, icon in names
    ]
    imgui.same_line()
    room = imgui.get_content_region_avail().x
    imgui.dummy(ImVec2(max(room - sum(widths) - style.item_spacing.x, 0.0), 0.0))
    for name, icon in names:
        imgui.same_line()
        button(name, controls, icon=icon, label="", lights=name != "panel")
