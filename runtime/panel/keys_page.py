"""The page of all keys: in groups, in as many columns as fit, with texts if there is room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from imgui_bundle import ImVec2, ImVec4, imgui

from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS
from runtime.control.match_actions import MATCH_ACTIONS
from runtime.control.session_actions import SESSION_ACTIONS
from runtime.control.show_controls import ShowControls
from runtime.panel.gui import GOLD, PAPER
from runtime.panel.widgets import card, letters

GROUPS: dict[str, tuple[str, ...]] = {
    "Matching": (
        "match-again",
        "accept",
        "next-match",
        "previous-match",
        "match-1",
        "keep-match",
        "rest-pose",
        "calibrate",
    ),
    "Mapping by hand": (
        "map-by-hand",
        "together",
        "phase-up",
        "phase-down",
        "widest-view",
        "clear-pairs",
    ),
    "Playing": ("hold", "home", "loop", "freeze", "select", "leave"),
    "Recording": (
        "record",
        "next-count-in",
        "rehearse",
        "undo",
        "redo",
        "retake",
        "recall",
        "save",
        "half-speed",
        "onion-skin",
    ),
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
}
"""The groups of actions, those most used first."""

TOGETHER = {"match-1": ("1 to 4", "Best matches", "light up the best match, or one after it")}
"""Rows that stand for several keys."""
SPELLED = {".": ". dot", ",": ", comma"}
MOUSE = (
    ("left button", "Turn", "go round the stage"),
    ("right button", "Shift", "move the picture"),
    ("wheel", "Zoom", "go nearer or farther"),
)
TRIED = (
    *((size, columns, True) for size in (1.0, 0.92, 0.84, 0.76) for columns in (2, 3)),
    *((size, columns, False) for size in (1.0, 0.92, 0.84) for columns in (2, 3, 4)),
)
"""What is tried until the page fits: height of letters, columns, and whether texts are shown."""
SMALLEST = (0.84, (3, 2, 1))  # height of letters and columns of a page that scrolls
LEAST_TEXT = 11.0  # the shortest line of a text, in heights of its letters

Row = tuple[str, str, str]  # key, label and text
Group = tuple[str, Sequence[Row]]


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the page is laid out; lengths in [px].

    Attributes:
        letters: times the usual height of letters.
        texts: whether texts are shown beside the labels.
        columns: the groups of each column.
        column: width of a column with its gap.
        label, text: where labels and texts begin in it.
        height: of the longest column.
        fits: whether no label is wider than its column.
    """

    letters: float
    texts: bool
    columns: Sequence[Sequence[Group]]
    column: float
    label: float
    text: float
    height: float
    fits: bool


def draw_keys(controls: ShowControls, margin: float) -> None:
    """Draw every key with what it does over the picture; a click closes the page."""
    screen = imgui.get_io().display_size
    groups = _groups(in_session=controls.session is not None)
    width, most = screen.x - 2.0 * margin, screen.y - 2.0 * margin
    with card("keys", margin, margin, width, opacity=0.96, most=most):
        with letters(1.4):
            imgui.text("Keys")
        imgui.same_line()
        imgui.text_disabled("  ? or a click closes this page")
        padding = imgui.get_style().window_padding
        top = imgui.get_cursor_pos_y()
        layout = _fitting(groups, width - 2.0 * padding.x, most - top - padding.y)
        with letters(layout.letters):
            for number, column in enumerate(layout.columns):
                _draw_column(column, layout, padding.x + number * layout.column, top)
        if imgui.is_window_hovered() and imgui.is_mouse_clicked(0):
            controls.view.help = False


def _groups(*, in_session: bool) -> list[Group]:
    """The groups with their rows, those of a session only in one; keys of no group come last."""
    idle = set() if in_session else set(SESSION_ACTIONS) - {"loop"}
    key_of = {name: key for key, name in KEYS.items() if name not in idle}
    grouped = [name for names in GROUPS.values() for name in names]
    rest = [name for name in key_of if name not in (*grouped, *MATCH_ACTIONS)]
    named = {**GROUPS, "More": tuple(rest)}
    groups: list[Group] = []
    for group, names in named.items():
        rows = [
            TOGETHER.get(name)
            or (SPELLED.get(key_of[name], key_of[name]), ACTIONS[name].label, ACTIONS[name].text)
            for name in names
            if name in key_of
        ]
        if rows:
            groups.append((group, rows))
    groups.append(("Mouse", list(MOUSE)))
    return groups


def _fitting(groups: Sequence[Group], width: float, height: float) -> _Layout:
    """The first layout that fits into so many pixels; else one that scrolls."""
    for size, columns, texts in TRIED:
        layout = _laid_out(groups, width, size, columns, texts=texts)
        if layout.fits and layout.height <= height:
            return layout
    size, counts = SMALLEST
    layouts = [_laid_out(groups, width, size, columns, texts=False) for columns in counts]
    return next((layout for layout in layouts if layout.fits), layouts[-1])


def _laid_out(
    groups: Sequence[Group], width: float, size: float, columns: int, *, texts: bool
) -> _Layout:
    with letters(size):
        line, gap = imgui.get_text_line_height(), imgui.get_style().item_spacing.x
        rows = [row for _, own in groups for row in own]
        label = max(imgui.calc_text_size(key).x for key, _, _ in rows) + 1.5 * gap
        text = label + max(imgui.calc_text_size(words).x for _, words, _ in rows) + 1.5 * gap
        column = (width + 3.0 * gap) / columns
        own = column - 3.0 * gap
        fits = own - text >= LEAST_TEXT * line if texts else own >= text - 1.5 * gap
        layout = _Layout(size, texts, (), column, label, text, 0.0, fits)
        if not fits:
            return layout
        heights = [_height(group, layout) for group in groups]
    limit = max(*heights, sum(heights) / columns)
    while len(shared := _shared(heights, limit)) > columns:
        limit += line
    return replace(
        layout,
        columns=[[groups[number] for number in part] for part in shared],
        height=max(sum(heights[number] for number in part) for part in shared),
    )


def _shared(heights: Sequence[float], limit: float) -> list[list[int]]:
    """The numbers of the groups in each column, each as full as the limit [px] allows."""
    shared: list[list[int]] = [[]]
    filled = 0.0
    for number, height in enumerate(heights):
        if shared[-1] and filled + height > limit:
            shared.append([])
            filled = 0.0
        shared[-1].append(number)
        filled += height
    return shared


def _height(group: Group, layout: _Layout) -> float:
    """How high a group is with the room below it, in the letters that are set [px]."""
    line = imgui.get_text_line_height()
    return 1.6 * line + sum(_row_height(row, layout) for row in group[1])


def _row_height(row: Row, layout: _Layout) -> float:
    line = imgui.get_text_line_height()
    if not layout.texts:
        return 1.22 * line
    return float(imgui.calc_text_size(row[2], False, _text_room(layout)).y) + 0.22 * line


def _text_room(layout: _Layout) -> float:
    """How long a line of a text may be [px]."""
    return layout.column - 3.0 * imgui.get_style().item_spacing.x - layout.text


def _draw_column(groups: Sequence[Group], layout: _Layout, left: float, top: float) -> None:
    line, y = imgui.get_text_line_height(), top
    gold = ImVec4(*GOLD, 1.0)
    for name, rows in groups:
        imgui.set_cursor_pos(ImVec2(left, y))
        imgui.text_colored(ImVec4(*PAPER, 0.62), name.upper())
        y += 1.2 * line
        for row in rows:
            imgui.set_cursor_pos(ImVec2(left, y))
            imgui.begin_group()
            imgui.text_colored(gold, row[0])
            imgui.set_cursor_pos(ImVec2(left + layout.label, y))
            imgui.text(row[1])
            imgui.end_group()
            if layout.texts:
                imgui.set_cursor_pos(ImVec2(left + layout.text, y))
                imgui.push_text_wrap_pos(left + layout.text + _text_room(layout))
                imgui.text_colored(ImVec4(*PAPER, 0.62), row[2])
                imgui.pop_text_wrap_pos()
            elif imgui.is_item_hovered():
                imgui.set_tooltip(row[2])
            y += _row_height(row, layout)
        y += 0.4 * line
