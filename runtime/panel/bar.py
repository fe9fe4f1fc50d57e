"""The bar along the lower edge: buttons, and the timeline of a recording."""

from __future__ import annotations

from collections.abc import Sequence

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
    "map-by-hand": icons.ICON_FA_HAND_POINTER,
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
ICONS_ALONE = ("home", "previous-match", "next-match")
OF_WINDOW = ("sliders", "audience", "full-screen", "panel", "help")
QUIET = ("full-screen", "audience", "panel", "map-by-hand")
"""The buttons that give up their words, one after another, before the bar takes a second row."""
TIME = 120.0  # [px] width of the line of time in a picture of the usual height
PLACE = "place of the match"


def draw_bar(status: ShowStatus, controls: ShowControls, margin: float, scale: float) -> float:
    """Draw the bar; return how high it is with its margin [px]."""
    screen = imgui.get_io().display_size
    with card("bar", margin, -margin, screen.x - 2.0 * margin):
        _Bar(status, controls, scale).draw()
        height: float = imgui.get_window_size().y
    return height + 2.0 * margin


class _Bar:
    """One drawing of the bar: its groups of buttons, in as many rows as they need."""

    def __init__(self, status: ShowStatus, controls: ShowControls, scale: float) -> None:
        self._controls, self._scale = controls, scale
        self._playback = None if status.session is not None else status.playback
        self._place = place_of_match(status, controls.match_controls.selected)
        playing = [] if self._playback is None else ["home", "hold"]
        matching = ["previous-match", PLACE, "next-match"] if self._place else []
        if status.matching:
            going_on = any(each.performing for each in status.characters if each.matching)
            matching += ["accept", "keep-match"] if going_on else ["accept"]
        usual = ["record", "freeze", "blackout", "match-again", "map-by-hand"]
        if controls.chooser.on:  # which has a card of its own
            usual, matching = usual[:3], []
        groups = [playing, usual, matching]
        self._groups = [group for group in groups if group]
        self._gap = float(imgui.get_style().item_spacing.x)
        self._silent: set[str] = set(ICONS_ALONE)
        self._rows = self._laid_out(imgui.get_content_region_avail().x)

    def draw(self) -> None:
        """Draw it into the window that is begun; the window's own buttons end at the right."""
        end = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
        for row in self._rows:
            for number, name in enumerate(row):
                if number:
                    imgui.same_line()
                if name == OF_WINDOW[0]:
                    imgui.set_cursor_pos_x(
                        max(end - self._length(OF_WINDOW), imgui.get_cursor_pos_x())
                    )
                self._draw(name)

    def _laid_out(self, room: float) -> list[list[str]]:
        """The rows of what fits into `room` [px]; a group begins a new row where it has to."""
        everything = [name for group in self._groups for name in group] + list(OF_WINDOW)
        for name in ("", *QUIET):
            self._silent.add(name)
            if self._length(everything) <= room:
                return [everything]
        self._silent -= set(QUIET)
        rows: list[list[str]] = [[]]
        for group in (*self._groups, list(OF_WINDOW)):
            if rows[-1] and self._length([*rows[-1], *group]) > room:
                rows.append([])
            for name in group:
                if rows[-1] and self._length([*rows[-1], name]) > room:
                    rows.append([])
                rows[-1].append(name)
        return rows

    def _length(self, names: Sequence[str]) -> float:
        """How long a row of these is [px]."""
        return sum(self._width(name) for name in names) + self._gap * (len(names) - 1)

    def _width(self, name: str) -> float:
        """How wide a button is, with the line of time where it belongs to it [px]."""
        if name == PLACE:
            return float(imgui.calc_text_size(self._place).x)
        words = " ".join(part for part in (self._icon(name), self._word(name)) if part)
        width: float = imgui.calc_text_size(words).x + 2.0 * imgui.get_style().frame_padding.x
        if name == "hold" and self._playback is not None:
            width += TIME * self._scale + imgui.calc_text_size(_time(self._playback)).x
            width += 2.0 * self._gap
        return width

    def _draw(self, name: str) -> None:
        if name == PLACE:
            imgui.align_text_to_frame_padding()
            imgui.text(self._place)
            return
        lights = name not in ("hold", "panel")
        button(name, self._controls, icon=self._icon(name), label=self._word(name), lights=lights)
        if name == "hold" and self._playback is not None:
            self._draw_time(self._playback)

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

    def _icon(self, name: str) -> str:
        if name == "hold":
            return icons.ICON_FA_PLAY if self._paused else icons.ICON_FA_PAUSE
        return ICONS[name]

    def _word(self, name: str) -> str:
        if name in self._silent:
            return ""
        if name == "hold":
            return "Play" if self._paused else "Pause"
        return ACTIONS[name].label

    @property
    def _paused(self) -> bool:
        return self._playback is not None and self._playback.paused


def _time(playback: PlaybackStatus) -> str:
    """Where a recording is, and how long it lasts."""
    return f"{clock(playback.position)} / {clock(playback.duration)}"
