"""The card with what the show sees, what to do next, and what has just happened."""

from __future__ import annotations

import math
from collections.abc import Sequence

from imgui_bundle import ImVec2, ImVec4, imgui

from runtime.panel.gui import GOLD, LACQUER, PAPER
from runtime.panel.widgets import Colour, card, dot, fitted, letters
from runtime.session.transport import Mode
from runtime.status.notices import Notice
from runtime.status.prompts import advice, counted_down, details, headline, is_paused
from runtime.status.show_status import ShowStatus
from runtime.status.stream_watch import Sight

LEAF = (0.44, 0.72, 0.36)
GREY = (0.55, 0.54, 0.52)
SIGHTS: dict[Sight, Colour] = {
    Sight.WAITING: GOLD,
    Sight.NOT_UNDERSTOOD: LACQUER,
    Sight.SEEN: LEAF,
    Sight.LOST: LACQUER,
    Sight.ENDED: GREY,
}
WIDTH = 700.0  # [px] in a picture of the usual height
LEAST = 320.0  # [px] likewise, below which nothing stands beside it
HEADLINE = 1.65  # times the height of usual letters
ADVICE = 1.1
COUNTDOWN = 9.0
COUNTED = 2.4
LEAST_DETAILS = 90.0  # [px] in a picture of the usual height


def draw_status(
    status: ShowStatus,
    notices: Sequence[Notice],
    left: float,
    width: float,
    margin: float,
    scale: float,
) -> tuple[float, float]:
    """Draw the card at the top, from `left` on, up to `width` wide [px], with all its lines.

    Return where it ends below [px]: without the notices, which come and go, and with them.
    """
    with card("status", left, margin, min(WIDTH * scale, width)):
        with letters(HEADLINE):
            dot(_light(status), 8.0 * scale)
            imgui.text(fitted(headline(status), imgui.get_content_region_avail().x))
            line = imgui.get_text_line_height()
        imgui.same_line(0.0, 14.0 * scale)
        room = imgui.get_content_region_avail().x
        if room > LEAST_DETAILS * scale:
            imgui.set_cursor_pos_y(
                imgui.get_cursor_pos_y() + 0.7 * (line - imgui.get_text_line_height())
            )
            imgui.text_disabled(fitted(details(status), room))
        else:
            imgui.new_line()
        with letters(ADVICE):
            imgui.push_text_wrap_pos(0.0)
            imgui.text(advice(status))
            imgui.pop_text_wrap_pos()
            _draw_hands_free(status, scale)
        for take in status.recording:
            dot(LACQUER, 6.0 * scale)
            imgui.text(f"recording {take.path.name}: {clock(take.seconds)}, {take.frames} frames")
        below = imgui.get_cursor_screen_pos().y - imgui.get_style().item_spacing.y
        _draw_lines(notices, scale)
        end = imgui.get_cursor_screen_pos().y
    return float(below + imgui.get_style().window_padding.y), float(end)


def _draw_hands_free(status: ShowStatus, scale: float) -> None:
    """What gesture does the next step, to be read from two metres, and how much of it is done."""
    if status.hands_free is None or not status.hands_free[0]:
        return
    wanted, progress = status.hands_free
    with letters(HEADLINE):
        imgui.push_text_wrap_pos(0.0)
        imgui.text_colored(ImVec4(*GOLD, 1.0), wanted)
        imgui.pop_text_wrap_pos()
    imgui.progress_bar(progress, ImVec2(-1.0, 10.0 * scale), "")


def _light(status: ShowStatus) -> Colour:
    """The colour of what is seen: green only while somebody drives the characters."""
    sight = status.sighting.sight
    plays = status.session is not None and status.session.mode in (Mode.PLAYING, Mode.PAUSED)
    if status.frozen or plays or is_paused(status):
        return GREY
    return GOLD if sight is Sight.SEEN and status.matching else SIGHTS[sight]


def draw_countdown(status: ShowStatus, below: float, scale: float) -> None:
    """Draw the seconds until a take or a match performs, large, `below` a card at the top [px]."""
    left = counted_down(status)
    if left is None or left <= 0.0 or status.sighting.sight is not Sight.SEEN:
        return
    fade = 0.35 + 0.65 * (left - math.floor(left))
    top = max(0.16 * imgui.get_io().display_size.y, below)
    if status.count_in is not None:
        with letters(COUNTED):
            top = _draw_large(f"{status.count_in[0].value} in", top, 1.0, scale)
    with letters(COUNTDOWN):
        _draw_large(str(math.ceil(left)), top, fade, scale)


def _draw_large(text: str, top: float, opacity: float, scale: float) -> float:
    """Draw a line with its shadow in the middle of the picture; return where it ends [px]."""
    size = imgui.calc_text_size(text)
    at = ImVec2((imgui.get_io().display_size.x - size.x) / 2.0, top)
    paint = imgui.get_background_draw_list()
    shade = imgui.get_color_u32(ImVec4(0.0, 0.0, 0.0, 0.5 * opacity))
    paint.add_text(ImVec2(at.x + 3.0 * scale, at.y + 3.0 * scale), shade, text)
    paint.add_text(at, imgui.get_color_u32(ImVec4(*PAPER, opacity)), text)
    return float(top + size.y)


def draw_hands_free(status: ShowStatus, margin: float, scale: float) -> None:
    """Draw what gesture does the next step on a card of its own, where no panel is shown."""
    if status.hands_free is not None and status.hands_free[0]:
        width = min(WIDTH * scale, imgui.get_io().display_size.x - 2.0 * margin)
        with card("gesture", margin, margin, width, opacity=0.55):
            _draw_hands_free(status, scale)


def draw_notices(notices: Sequence[Notice], margin: float, scale: float) -> None:
    """Draw what happened last on a card of its own, where no panel is shown."""
    if not notices:
        return
    screen = imgui.get_io().display_size
    widest = max(imgui.calc_text_size(notice.text).x for notice in notices)
    width = min(widest + 56.0 * scale, screen.x - 40.0 * scale)
    with card("notices", (screen.x - width) / 2.0, -margin, width):
        _draw_lines(notices, scale)


def _draw_lines(notices: Sequence[Notice], scale: float) -> None:
    """A line for each notice, the newest lowest."""
    for notice in notices:
        dot(LACQUER if notice.fault else GOLD, 4.0 * scale)
        imgui.text_wrapped(notice.text)


def clock(seconds: float) -> str:
    """Minutes and seconds, as 1:05."""
    minutes, rest = divmod(max(seconds, 0.0), 60.0)
    return f"{int(minutes)}:{int(rest):02}"
