"""Dear ImGui in one window: its fonts, its colours, and the window's input."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import imgui_bundle
from imgui_bundle import ImVec2, imgui

from runtime.render.gui_painter import GuiPainter

if TYPE_CHECKING:
    import moderngl

FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
LETTERS = FONTS / "Roboto" / "Roboto-Regular.ttf"
ICONS = FONTS / "Font_Awesome_6_Free-Solid-900.otf"

LETTER = 17.0  # [px] height of letters in a picture of the usual height
USUAL_HEIGHT = 720.0  # [px]
LEAST_WIDTH = 960.0  # [px] of a picture of the usual height; a narrower one has smaller letters
LONGEST_STEP = 0.1  # [s] that ImGui's animations may go on by at once

KEYS = {
    "tab": imgui.Key.tab,
    "left": imgui.Key.left_arrow,
    "right": imgui.Key.right_arrow,
    "up": imgui.Key.up_arrow,
    "down": imgui.Key.down_arrow,
    "home": imgui.Key.home,
    "end": imgui.Key.end,
    "delete": imgui.Key.delete,
    "backspace": imgui.Key.backspace,
    "enter": imgui.Key.enter,
    "escape": imgui.Key.escape,
    "a": imgui.Key.a,
    "c": imgui.Key.c,
    "v": imgui.Key.v,
    "x": imgui.Key.x,
    "z": imgui.Key.z,
}
"""ImGui's keys that edit a text, by the window's names for them."""

PAPER = (0.93, 0.90, 0.84)
INK = (0.085, 0.075, 0.085)
LACQUER = (0.78, 0.24, 0.16)
GOLD = (0.93, 0.74, 0.42)

COLOURS: dict[Any, tuple[float, float, float, float]] = {
    imgui.Col_.text: (*PAPER, 1.0),
    imgui.Col_.text_disabled: (*PAPER, 0.62),
    imgui.Col_.window_bg: (*INK, 0.84),
    imgui.Col_.popup_bg: (*INK, 0.96),
    imgui.Col_.child_bg: (0.0, 0.0, 0.0, 0.0),
    imgui.Col_.border: (*PAPER, 0.10),
    imgui.Col_.frame_bg: (*PAPER, 0.10),
    imgui.Col_.frame_bg_hovered: (*PAPER, 0.17),
    imgui.Col_.frame_bg_active: (*PAPER, 0.24),
    imgui.Col_.button: (*PAPER, 0.12),
    imgui.Col_.button_hovered: (*PAPER, 0.24),
    imgui.Col_.button_active: (*LACQUER, 0.85),
    imgui.Col_.header: (*PAPER, 0.08),
    imgui.Col_.header_hovered: (*PAPER, 0.16),
    imgui.Col_.header_active: (*PAPER, 0.22),
    imgui.Col_.slider_grab: (*GOLD, 0.95),
    imgui.Col_.slider_grab_active: (*GOLD, 1.0),
    imgui.Col_.check_mark: (*GOLD, 1.0),
    imgui.Col_.separator: (*PAPER, 0.12),
    imgui.Col_.scrollbar_bg: (0.0, 0.0, 0.0, 0.0),
    imgui.Col_.scrollbar_grab: (*PAPER, 0.20),
}
"""Paper and ink of a theatre bill, straight alpha, encoded sRGB."""

LENGTHS = {
    "font_size_base": LETTER,
    "window_rounding": 10.0,
    "popup_rounding": 10.0,
    "child_rounding": 8.0,
    "frame_rounding": 6.0,
    "grab_rounding": 6.0,
    "window_border_size": 0.0,
    "frame_border_size": 0.0,
    "indent_spacing": 14.0,
    "grab_min_size": 14.0,
    "scrollbar_size": 10.0,
}
SPACES = {
    "window_padding": (14.0, 12.0),
    "frame_padding": (9.0, 6.0),
    "item_spacing": (8.0, 7.0),
    "item_inner_spacing": (6.0, 5.0),
}
"""Lengths of ImGui's style [px] in a picture of the usual height."""


class Gui:
    """ImGui in an OpenGL context: takes input, lays out widgets, draws them over a picture.

    It belongs to the thread of its context. Several may live side by side.

    Args:
        context: the OpenGL context of this thread.
    """

    def __init__(self, context: moderngl.Context) -> None:
        self._imgui = imgui.create_context()
        self._enter()
        io = imgui.get_io()
        io.set_ini_filename("")  # remembers nothing on the disk
        io.set_log_filename("")
        io.config_windows_move_from_title_bar_only = True
        io.fonts.add_font_from_file_ttf(str(LETTERS), LETTER)
        icons = imgui.ImFontConfig()
        icons.merge_mode = True
        io.fonts.add_font_from_file_ttf(str(ICONS), LETTER, icons)
        self._painter = GuiPainter(context)
        self._scale = 0.0
        self._held: set[int] = set()

    @property
    def scale(self) -> float:
        """Pixels for each pixel of a picture of the usual height."""
        return self._scale

    def begin(self, size: tuple[int, int], seconds: float) -> None:
        """Begin to lay out widgets in a picture of `size` [px], `seconds` after the last time."""
        self._enter()
        self._fit(min(size[0] / LEAST_WIDTH, size[1] / USUAL_HEIGHT))
        io = imgui.get_io()
        io.display_size = ImVec2(*size)
        io.delta_time = min(max(seconds, 1e-4), LONGEST_STEP)
        imgui.new_frame()

    def draw(self, target: moderngl.Framebuffer) -> None:
        """Draw the widgets that were laid out since `begin` over a picture of that size."""
        imgui.render()
        self._painter.draw(imgui.get_draw_data(), target)

    def close(self) -> None:
        """Free everything; its OpenGL context must be current."""
        self._enter()
        self._painter.release()
        imgui.destroy_context(self._imgui)

    # -- Input; each returns whether the widgets keep it for themselves ----------------------------

    def key(self, name: str, *, down: bool, shift: bool, control: bool) -> bool:
        """Take a key, by the window's name for it."""
        io = self._enter()
        io.add_key_event(imgui.Key.mod_shift, shift)
        io.add_key_event(imgui.Key.mod_ctrl, control)
        if name in KEYS:
            io.add_key_event(KEYS[name], down)
        return bool(io.want_text_input)

    def letter(self, character: str) -> bool:
        """Take a typed character."""
        io = self._enter()
        io.add_input_character(ord(character))
        return bool(io.want_text_input)

    def button(self, button: int, *, down: bool) -> bool:
        """Take a button of the mouse: 0 left, 1 right, 2 middle.

        What was pressed outside the widgets is let go outside them.
        """
        io = self._enter()
        io.add_mouse_button_event(button, down)
        if down:
            keeps = bool(io.want_capture_mouse)
            if keeps:
                self._held.add(button)
            return keeps
        keeps = button in self._held
        self._held.discard(button)
        return keeps

    def cursor(self, x: float, y: float) -> bool:
        """Take the place of the mouse [px] from the picture's upper left corner."""
        io = self._enter()
        io.add_mouse_pos_event(x, y)
        return bool(self._held)

    def scroll(self, right: float, up: float) -> bool:
        """Take notches of the wheel."""
        io = self._enter()
        io.add_mouse_wheel_event(right, up)
        return bool(io.want_capture_mouse)

    def _enter(self) -> imgui.IO:
        imgui.set_current_context(self._imgui)
        return imgui.get_io()

    def _fit(self, scale: float) -> None:
        """Size letters and widgets for a picture `scale` times as high as the usual one."""
        scale = max(round(scale * 8.0) / 8.0, 0.5)
        if scale == self._scale:
            return
        self._scale = scale
        imgui.set_current_context(self._imgui)
        style = imgui.get_style()
        for name, value in LENGTHS.items():
            setattr(style, name, scale * value)
        for name, (across, down) in SPACES.items():
            setattr(style, name, ImVec2(scale * across, scale * down))
        for colour, tint in COLOURS.items():
            style.set_color_(colour, tint)
