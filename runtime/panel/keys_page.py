"""The page of all keys."""

from __future__ import annotations

from imgui_bundle import ImVec2, ImVec4, imgui

from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS
from runtime.control.session_actions import SESSION_ACTIONS
from runtime.control.show_controls import ShowControls
from runtime.panel.gui import GOLD
from runtime.panel.widgets import card, heading, letters

COLUMNS: tuple[dict[str, tuple[str, ...]], ...] = (
    {
        "Matching": (
            "match-again",
            "accept",
            "next-match",
            "previous-match",
            "keep-match",
            "rest-pose",
            "calibrate",
        ),
        "Playing": ("hold", "home", "freeze", "select", "leave"),
        "Recording": (
            "record",
            "rehearse",
            "undo",
            "redo",
            "retake",
            "recall",
            "save",
            "loop",
            "half-speed",
        ),
    },
    {
        "Look": (
            "help",
            "panel",
            "sliders",
            "frame-all",
            "front",
            "chains",
            "full-screen",
            "audience",
            "blackout",
            "in-place",
        ),
        "Surface": (
            "cartoon-up",
            "cartoon-down",
            "volume-up",
            "volume-down",
            "stiffness-up",
            "stiffness-down",
        ),
        "Corrections": (
            "mirror",
            "filter",
            "predict",
            "outliers",
            "swaps",
            "identities",
            "level",
            "scale",
            "recalibrate",
            "order",
        ),
    },
)
"""The groups of actions in each column, those most used first."""

SPELLED = {".": ". dot", ",": ", comma"}
TEXT = 350.0  # [px] the longest line of a text in a picture of the usual height
MOUSE = (
    ("left button", "turn round the stage"),
    ("right button", "shift the picture"),
    ("wheel", "nearer or farther"),
)


def draw_keys(controls: ShowControls, left: float, margin: float, scale: float) -> None:
    """Draw every key with what it does, in groups, from `left` [px] on; a click closes it."""
    screen = imgui.get_io().display_size
    width, height = screen.x - left - margin, screen.y - 2.0 * margin
    spacing = imgui.get_style().item_spacing
    with card("keys", left, margin, width, opacity=0.96, most=height):
        with letters(1.4):
            imgui.text("Keys")
        imgui.same_line()
        imgui.text_disabled("  ? or a click closes this page")
        imgui.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(spacing.x, 0.45 * spacing.y))
        if imgui.begin_table("columns", len(COLUMNS)):
            for column, groups in enumerate(_columns(in_session=controls.session is not None)):
                imgui.table_next_column()
                for name, rows in groups:
                    heading(name)
                    _draw_rows(f"{name}{column}", rows, scale)
                    imgui.dummy(ImVec2(0.0, 2.0 * scale))
            imgui.end_table()
        imgui.pop_style_var()
        if imgui.is_window_hovered() and imgui.is_mouse_clicked(0):
            controls.view.help = False


def _columns(*, in_session: bool) -> list[list[tuple[str, list[tuple[str, str]]]]]:
    """Each column's groups, with their rows of keys and texts; keys of no group come after them.

    Without a session, its keys are left out.
    """
    idle = set() if in_session else set(SESSION_ACTIONS) - {"loop"}
    key_of = {name: key for key, name in KEYS.items() if name not in idle}
    grouped = [name for groups in COLUMNS for names in groups.values() for name in names]
    rest = [name for name in key_of if name not in grouped]
    columns = [
        [
            (group, [(key_of[name], ACTIONS[name].text) for name in names if name in key_of])
            for group, names in groups.items()
        ]
        for groups in COLUMNS
    ]
    if rest:
        columns[0].append(("More", [(key_of[name], ACTIONS[name].text) for name in rest]))
    columns[0].append(("Mouse", list(MOUSE)))
    return columns


def _draw_rows(name: str, rows: list[tuple[str, str]], scale: float) -> None:
    if not imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit, ImVec2(0.0, 0.0)):
        return
    for key, text in rows:
        imgui.table_next_column()
        imgui.text_colored(ImVec4(*GOLD, 1.0), SPELLED.get(key, key))
        imgui.table_next_column()
        imgui.push_text_wrap_pos(imgui.get_cursor_pos().x + TEXT * scale)
        imgui.text(text)
        imgui.pop_text_wrap_pos()
    imgui.end_table()
