"""The page of all keys."""

from __future__ import annotations

from imgui_bundle import ImVec2, ImVec4, imgui

from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS
from runtime.control.show_controls import ShowControls
from runtime.panel.gui import GOLD
from runtime.panel.widgets import card, heading, letters

MOUSE = (
    ("left button", "turn round the stage"),
    ("right button", "shift the picture"),
    ("wheel", "nearer or farther"),
)


def draw_keys(controls: ShowControls, margin: float, scale: float) -> None:
    """Draw every key with what it does, over the whole picture; a click closes it."""
    screen = imgui.get_io().display_size
    width = min(980.0 * scale, screen.x - 2.0 * margin)
    height = min(640.0 * scale, screen.y - 2.0 * margin)
    left, top = (screen.x - width) / 2.0, (screen.y - height) / 2.0
    with card("keys", left, top, width, height, opacity=0.96):
        with letters(1.4):
            imgui.text("Keys")
        imgui.same_line()
        imgui.text_disabled("  ? or a click closes this page")
        rows = [(key, ACTIONS[name].text) for key, name in KEYS.items()]
        half = (len(rows) + len(MOUSE) + 2) // 2
        if imgui.begin_table("two", 2):
            imgui.table_next_column()
            _draw_rows("left", rows[:half], scale)
            imgui.table_next_column()
            _draw_rows("right", rows[half:], scale)
            heading("Mouse")
            _draw_rows("mouse", list(MOUSE), scale)
            imgui.end_table()
        if imgui.is_window_hovered() and imgui.is_mouse_clicked(0):
            controls.view.help = False


def _draw_rows(name: str, rows: list[tuple[str, str]], scale: float) -> None:
    if not imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit, ImVec2(0.0, 0.0)):
        return
    for key, text in rows:
        imgui.table_next_column()
        imgui.text_colored(ImVec4(*GOLD, 1.0), key)
        imgui.table_next_column()
        imgui.push_text_wrap_pos(imgui.get_cursor_pos().x + 370.0 * scale)
        imgui.text(text)
        imgui.pop_text_wrap_pos()
    imgui.end_table()
