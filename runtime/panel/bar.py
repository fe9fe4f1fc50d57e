"""The bar along the lower border: the buttons, and the line of time of a recording."""

from __future__ import annotations

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from runtime.control.actions import ACTIONS
from runtime.control.show_controls import ShowControls
from runtime.panel.status_card import clock
from runtime.panel.widgets import button, card
from runtime.status.prompts import place_of_match
from runtime.status.show_status import PlaybackStatus, ShowStatus

ICONS = {
    "home": icons.ICON_FA_BACKWARD_STEP,
    "record": icons.ICON_FA_CIRCLE,
    "freeze": icons.ICON_FA_SNOWFLAKE,
    "blackout": icons.ICON_FA_MOON,
    "match-again": icons.ICON_FA_PERSON_RAYS,
    "previous-match": icons.ICON_FA_CHEVRON_LEFT,
    "next-match": icons.ICON_FA_CHEVRON_RIGHT,
    "accept": icons.ICON_FA_CHECK,
    "keep-match": icons.ICON_FA_ROTATE_LEFT,
    "sliders": icons.ICON_FA_SLIDERS,
    "full-screen": icons.ICON_FA_EXPAND,
    "audience": icons.ICON_FA_DISPLAY,
    "panel": icons.ICON_FA_EYE_SLASH,
    "help": icons.ICON_FA_CIRCLE_QUESTION,
}
SHORT = {"help": "Keys", "panel": "Hide", "match-again": "Match again"}
WORDED = (
    "accept",
    "keep-match",
    "record",
    "match-again",
    "hold",
    "help",
    "freeze",
    "sliders",
    "blackout",
    "panel",
    "audience",
    "full-screen",
)
"""The buttons with words, as long as there is room for them: the first ones first."""
OF_WINDOW = ("sliders", "audience", "full-screen", "panel", "help")
TIME = 120.0  # [px] width of the line of time in a picture of the usual height


def draw_bar(status: ShowStatus, controls: ShowControls, margin: float, scale: float) -> float:
    """Draw the bar; return how high it is with its margin [px]."""
    screen = imgui.get_io().display_size
    with card("bar", margin, -margin, screen.x - 2.0 * margin):
        _Bar(status, controls, scale).draw()
        height: float = imgui.get_window_size().y
    return height + 2.0 * margin


class _Bar:
    """One drawing of the bar: its buttons from left to right, with words where they fit."""

    def __init__(self, status: ShowStatus, controls: ShowControls, scale: float) -> None:
        self._controls, self._scale = controls, scale
        self._playback = None if status.session is not None else status.playback
        self._place = place_of_match(status, controls.match_controls.selected)
        self._left = ["record", "freeze", "blackout", "match-again"]
        if self._playback is not None:
            self._left = ["home", "hold", *self._left]
        self._chosen = ["previous-match", "next-match"] if self._place else []
        self._deciding = []
        if status.matching:
            going_on = any(each.performing for each in status.characters if each.matching)
            self._deciding = ["accept", "keep-match"] if going_on else ["accept"]
        self._words: set[str] = set()
        self._words = self._fitting_words()

    def draw(self) -> None:
        """Draw it into the window that is begun."""
        end = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
        for number, name in enumerate(self._left):
            if number:
                imgui.same_line()
            self._button(name)
            if name == "hold" and self._playback is not None:
                self._draw_time(self._playback)
        if self._place:
            self._draw_place()
        for name in self._deciding:
            imgui.same_line()
            self._button(name)
        widths = [self._width(name) + imgui.get_style().item_spacing.x for name in OF_WINDOW]
        imgui.same_line()
        imgui.set_cursor_pos_x(max(end - sum(widths), imgui.get_cursor_pos_x()))
        for number, name in enumerate(OF_WINDOW):
            if number:
                imgui.same_line()
            self._button(name)

    def _draw_time(self, playback: PlaybackStatus) -> None:
        imgui.same_line()
        imgui.set_next_item_width(TIME * self._scale)
        changed, moment = imgui.slider_float(
            "##time", playback.position, 0.0, max(playback.duration, 1e-6), ""
        )
        if changed and self._controls.playback is not None:
            self._controls.playback.seek(min(max(moment, 0.0), playback.duration))
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text(_time(playback))

    def _draw_place(self) -> None:
        imgui.same_line()
        self._button("previous-match")
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text(self._place)
        imgui.same_line()
        self._button("next-match")

    def _button(self, name: str) -> None:
        lights = name not in ("hold", "panel")
        button(name, self._controls, icon=self._icon(name), label=self._word(name), lights=lights)

    def _icon(self, name: str) -> str:
        if name == "hold":
            return icons.ICON_FA_PLAY if self._paused else icons.ICON_FA_PAUSE
        return ICONS[name]

    def _word(self, name: str) -> str:
        return self._usual_word(name) if name in self._words else ""

    def _usual_word(self, name: str) -> str:
        if name == "hold":
            return "Play" if self._paused else "Pause"
        return SHORT.get(name, ACTIONS[name].label)

    @property
    def _paused(self) -> bool:
        return self._playback is not None and self._playback.paused

    def _width(self, name: str) -> float:
        words = " ".join(part for part in (self._icon(name), self._word(name)) if part)
        width: float = imgui.calc_text_size(words).x + 2.0 * imgui.get_style().frame_padding.x
        return width

    def _fitting_words(self) -> set[str]:
        """The buttons that have room for words besides their icons."""
        gap = imgui.get_style().item_spacing.x
        names = [*self._left, *self._chosen, *self._deciding, *OF_WINDOW]
        taken = sum(self._width(name) + gap for name in names) + gap
        if self._playback is not None:
            taken += TIME * self._scale + imgui.calc_text_size(_time(self._playback)).x + 2.0 * gap
        if self._place:
            taken += imgui.calc_text_size(self._place).x + gap
        room = imgui.get_content_region_avail().x - taken
        words: set[str] = set()
        for name in WORDED:
            width = imgui.calc_text_size(f" {self._usual_word(name)}").x
            if name in names and width <= room:
                words.add(name)
                room -= width
        return words


def _time(playback: PlaybackStatus) -> str:
    """Where a recording is, and how long it lasts."""
    return f"{clock(playback.position)} / {clock(playback.duration)}"
