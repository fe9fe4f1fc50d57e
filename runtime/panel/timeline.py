"""The timeline of a session: clips as bars, one row per layer, and a line at the present moment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from devices.errors import InputError
from runtime.control.actions import ACTIONS
from runtime.control.show_controls import ShowControls
from runtime.panel.gui import GOLD, INK, LACQUER, PAPER
from runtime.panel.status_card import clock
from runtime.panel.widgets import Colour, beside, button, card
from runtime.session import edits
from runtime.session.document import Clip, Session
from runtime.session.live_session import LiveSession
from runtime.session.transport import Mode

LAYERS = 5  # rows that are shown at once; the wheel goes to the others
ROW = 22.0  # [px] in a picture of the usual height
RULER = 20.0
NAMES = 110.0
WEIGHT = 90.0  # of the slider of a clip's weight
EDGE = 6.0  # [px] at either end of a bar that drag its end
LEAST = 10.0  # [s] that are shown at least
STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0)  # [s] between two ticks
TICK = 70.0  # [px] between two ticks at least
COLOURS: tuple[Colour, ...] = (GOLD, (0.44, 0.72, 0.36), (0.40, 0.62, 0.86), (0.80, 0.52, 0.78))


class DraggedPart(Enum):
    """Which part of a clip's bar the mouse drags."""

    START = "start"
    BODY = "body"
    END = "end"


@dataclass(slots=True)
class _Held:
    """A clip that the mouse drags: as it was when it was taken hold of."""

    clip: Clip
    part: DraggedPart
    from_time: float


@dataclass(slots=True)
class _Scale:
    """Where seconds are on the screen: the first one at `left` [px], `second` [px] wide."""

    left: float
    second: float

    def x(self, time: float) -> float:
        return self.left + time * self.second

    def time(self, x: float) -> float:
        return (x - self.left) / self.second


class Timeline:
    """Draws the timeline and does what is done on it; it remembers what is selected.

    Attributes:
        selected: the id of the selected clip; None for none.
        ruler: (2,) [px] the upper left end of the ruler, as it was drawn last.
    """

    def __init__(self) -> None:
        self.ruler = (0.0, 0.0)
        self.selected: int | None = None
        self._held: _Held | None = None
        self._scrubs = False
        self._first = 0  # the highest row that is shown

    def draw(self, controls: ShowControls, margin: float, above: float, scale: float) -> float:
        """Draw the timeline `above` the lower border [px]; return how high it is [px]."""
        session = controls.session
        assert session is not None
        document = session.session
        screen = imgui.get_io().display_size
        rows = min(max(len(document.clips), 1), LAYERS)
        with card("timeline", margin, -above, screen.x - 2.0 * margin):
            self._draw_buttons(session, controls, scale)
            self._draw_lanes(session, document, rows, scale)
            height: float = imgui.get_window_size().y
        return height

    # -- Buttons -----------------------------------------------------------------------------------

    def _draw_buttons(self, session: LiveSession, controls: ShowControls, scale: float) -> None:
        transport = session.transport
        playing = transport.mode is Mode.PLAYING
        button("home", controls, icon=icons.ICON_FA_BACKWARD_STEP, label="")
        icon = icons.ICON_FA_PAUSE if playing else icons.ICON_FA_PLAY
        _next("hold", controls, icon, label="Pause" if playing else "Play", lights=False)
        _next("rehearse", controls, icons.ICON_FA_STOP, lights=False)
        _next("loop", controls, icons.ICON_FA_REPEAT, label="")
        words = f"{_precise(transport.position)} / {clock(transport.duration)}"
        beside(words, 16.0 * scale)
        imgui.align_text_to_frame_padding()
        imgui.text(words)
        _next("undo", controls, icons.ICON_FA_ROTATE_LEFT, label="", gap=16.0 * scale)
        _next("redo", controls, icons.ICON_FA_ROTATE_RIGHT, label="")
        _next("retake", controls, icons.ICON_FA_ARROWS_ROTATE)
        _next("recall", controls, icons.ICON_FA_CLOCK_ROTATE_LEFT)
        _next("save", controls, icons.ICON_FA_FLOPPY_DISK, label="")
        _next("onion-skin", controls, icons.ICON_FA_GHOST, label="")
        clip = self._chosen(session.session)
        if clip is not None:
            beside("mute", 24.0 * scale)
            self._draw_clip(session, clip, scale)

    def _draw_clip(self, session: LiveSession, clip: Clip, scale: float) -> None:
        """The buttons of the selected clip."""
        document, position = session.session, session.transport.position
        number = clip.id
        if _toggle("mute", clip.muted):
            self._do(session, edits.muted(document, number, not clip.muted), "mute a clip")
        beside("solo")
        if _toggle("solo", clip.solo):
            self._do(session, edits.soloed(document, number, not clip.solo), "solo a clip")
        beside("add")
        if _toggle("add", clip.additive):
            added = edits.made_additive(document, number, not clip.additive)
            self._do(session, added, "add a clip")
        beside("a weight of 100 %")
        imgui.set_next_item_width(WEIGHT * scale)
        changed, weight = imgui.slider_float("##weight", 100.0 * clip.weight, 0.0, 100.0, "%.0f %%")
        if changed:
            counted = edits.weighted(document, number, min(max(weight / 100.0, 0.0), 1.0))
            session.drag(counted, f"weigh clip {number}")
        if imgui.is_item_deactivated_after_edit():
            session.drop()
        beside("cut")
        if imgui.button("cut"):
            self._try(session, lambda: edits.split(document, number, position), "cut a clip")
        beside("copy")
        if imgui.button("copy"):
            self._do(session, edits.copied(document, number, position), "copy a clip")
            self.selected = session.session.clips[-1].id
        beside("remove")
        if imgui.button("remove"):
            self._do(session, edits.without_clip(document, number), "remove a clip")
            self.selected = None

    # -- Lanes -------------------------------------------------------------------------------------

    def _draw_lanes(self, session: LiveSession, document: Session, rows: int, scale: float) -> None:
        at, room = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
        row, ruler, names = ROW * scale, RULER * scale, NAMES * scale
        wide = room - names
        shown = max(document.duration, session.transport.duration, LEAST) * 1.04
        places = _Scale(at.x + names, wide / shown)
        self.ruler = (places.left, at.y)
        height = ruler + rows * row
        imgui.invisible_button("lanes", ImVec2(room, height))
        over, active = imgui.is_item_hovered(), imgui.is_item_active()
        paint = imgui.get_window_draw_list()
        paint.push_clip_rect(at, ImVec2(at.x + room, at.y + height), True)
        _draw_ruler(paint, places, at.y, height, shown, scale)
        self._first = min(self._first, max(len(document.clips) - rows, 0))
        every = list(reversed(document.clips))[self._first :][:rows]  # the highest layer on top
        for place, clip in enumerate(every):
            top = at.y + ruler + place * row
            self._draw_bar(paint, document, clip, places, at.x, top, row, scale)
        _draw_marks(paint, document, places, at.y, height)
        x = places.x(session.transport.position)
        red = imgui.get_color_u32(ImVec4(*LACQUER, 1.0))
        paint.add_line(ImVec2(x, at.y), ImVec2(x, at.y + height), red, 2.0 * scale)
        if len(document.clips) > rows:
            more = f"{self._first + 1} to {self._first + rows} of {len(document.clips)}"
            faint = imgui.get_color_u32(ImVec4(*PAPER, 0.62))
            paint.add_text(at, faint, more)
        paint.pop_clip_rect()
        mouse = imgui.get_mouse_pos()
        held = None
        if over or active:
            index = math.floor((mouse.y - at.y - ruler) / row) if mouse.y >= at.y + ruler else -1
            clip_there = every[index] if 0 <= index < len(every) else None
            held = None if clip_there is None else _part_at(clip_there, places, mouse.x, scale)
            if held in (DraggedPart.START, DraggedPart.END):
                imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
            wanted = self._first - round(imgui.get_io().mouse_wheel)
            self._first = min(max(wanted, 0), max(len(document.clips) - rows, 0))
            if imgui.is_item_activated():
                self._take_hold(clip_there, held, places.time(mouse.x))
        if active:
            self._drag(session, places.time(mouse.x))
        if imgui.is_item_deactivated():
            if self._held is not None:
                session.drop()
            self._held, self._scrubs = None, False

    def _draw_bar(
        self,
        paint: imgui.ImDrawList,
        document: Session,
        clip: Clip,
        places: _Scale,
        left: float,
        top: float,
        row: float,
        scale: float,
    ) -> None:
        take = document.take(clip.take)
        actors = [actor.id for actor in document.actors]
        colour = COLOURS[actors.index(take.actor) % len(COLOURS)]
        dim = imgui.get_color_u32(ImVec4(*PAPER, 0.72))
        paint.add_text(ImVec2(left, top + 3.0 * scale), dim, document.actor(take.actor).name[:14])
        share = 0.25 if clip.muted else 0.45 + 0.45 * clip.weight
        start, end = places.x(clip.start), max(places.x(clip.end), places.x(clip.start) + 3.0)
        low, high = ImVec2(start, top + 1.0), ImVec2(end, top + row - 2.0)
        paint.add_rect_filled(low, high, imgui.get_color_u32(ImVec4(*colour, share)), 3.0 * scale)
        if clip.id == self.selected:
            white = imgui.get_color_u32(ImVec4(*PAPER, 1.0))
            paint.add_rect(low, high, white, 3.0 * scale, thickness=1.5 * scale)
        words = f"{take.name}{_manner(clip)}"
        ink = imgui.get_color_u32(ImVec4(*(INK if not clip.muted else PAPER), 1.0))
        paint.push_clip_rect(low, high, True)
        paint.add_text(ImVec2(start + 5.0 * scale, top + 3.0 * scale), ink, words)
        paint.pop_clip_rect()

    def _take_hold(self, clip: Clip | None, part: DraggedPart | None, time: float) -> None:
        if clip is None or part is None:
            self._scrubs = True
            self.selected = None
            return
        self.selected = clip.id
        self._held = _Held(clip, part, time)

    def _drag(self, session: LiveSession, time: float) -> None:
        """Go on with what the mouse holds: the moment that is shown, or a clip."""
        if self._scrubs:
            session.transport.seek(max(time, 0.0))
            return
        if self._held is None or abs(time - self._held.from_time) < 1e-9:
            return
        clip, moved = self._held.clip, time - self._held.from_time
        document = session.session
        try:
            if self._held.part is DraggedPart.BODY:
                dragged, done = edits.moved(document, clip.id, clip.start + moved), "move a clip"
            else:
                start = clip.start + (moved if self._held.part is DraggedPart.START else 0.0)
                end = clip.end + (moved if self._held.part is DraggedPart.END else 0.0)
                whole = edits.replaced(document, clip)
                dragged, done = edits.trimmed(whole, clip.id, start, end), "trim a clip"
        except InputError:
            return  # nothing would be left of it
        session.drag(dragged, done)

    # -- Edits -------------------------------------------------------------------------------------

    def _chosen(self, document: Session) -> Clip | None:
        """The selected clip, if it is still there."""
        return next((clip for clip in document.clips if clip.id == self.selected), None)

    @staticmethod
    def _do(session: LiveSession, edited: Session, done: str) -> None:
        session.edit(edited, done)

    @staticmethod
    def _try(session: LiveSession, edit: edits.Edit, done: str) -> None:
        try:
            session.edit(edit(), done)
        except InputError as error:
            session.say(str(error))


def _part_at(clip: Clip, places: _Scale, x: float, scale: float) -> DraggedPart | None:
    """The part of a clip's bar at x [px]; None beside it."""
    start, end, edge = places.x(clip.start), places.x(clip.end), EDGE * scale
    if not start - edge <= x <= end + edge:
        return None
    if end - start > 4.0 * edge:
        if x < start + edge:
            return DraggedPart.START
        if x > end - edge:
            return DraggedPart.END
    return DraggedPart.BODY


def _draw_ruler(
    paint: imgui.ImDrawList, places: _Scale, top: float, height: float, shown: float, scale: float
) -> None:
    """Seconds, as far apart as they can be read."""
    step = next((each for each in STEPS if each * places.second >= TICK * scale), STEPS[-1])
    faint = imgui.get_color_u32(ImVec4(*PAPER, 0.16))
    words = imgui.get_color_u32(ImVec4(*PAPER, 0.62))
    for number in range(int(shown / step) + 1):
        x = places.x(number * step)
        paint.add_line(ImVec2(x, top), ImVec2(x, top + height), faint)
        said = clock(number * step) if step >= 1.0 else _precise(number * step)
        paint.add_text(ImVec2(x + 3.0 * scale, top), words, said)


def _draw_marks(
    paint: imgui.ImDrawList, document: Session, places: _Scale, top: float, height: float
) -> None:
    gold = imgui.get_color_u32(ImVec4(*GOLD, 0.9))
    for mark in document.marks:
        x = places.x(mark.time)
        paint.add_line(ImVec2(x, top), ImVec2(x, top + height), gold)
        line = imgui.get_text_line_height()
        paint.add_text(ImVec2(x + 3.0, top + height - line), gold, mark.name)
    if document.punch is not None:
        shade = imgui.get_color_u32(ImVec4(*LACQUER, 0.22))
        start, end = (places.x(time) for time in document.punch)
        paint.add_rect_filled(ImVec2(start, top), ImVec2(end, top + height), shade)


def _manner(clip: Clip) -> str:
    """How a clip plays, where that is not as it was performed."""
    said = [
        f"x{clip.speed:.2g}" if clip.speed != 1.0 else "",
        f"{clip.passes:.3g} times" if clip.passes != 1.0 else "",
        "adds" if clip.additive else "",
        "muted" if clip.muted else "",
        "solo" if clip.solo else "",
    ]
    return "".join(f", {each}" for each in said if each)


def _next(
    name: str,
    controls: ShowControls,
    icon: str,
    *,
    label: str | None = None,
    lights: bool = True,
    gap: float = -1.0,
) -> None:
    """The button of an action beside the one before, or below where there is no room."""
    words = ACTIONS[name].label if label is None else label
    beside(f"{icon} {words}" if words else icon, gap)
    button(name, controls, icon=icon, label=label, lights=lights)


def _toggle(label: str, on: bool) -> bool:
    """A button that is lit while it is on; whether it was pressed."""
    if on:
        imgui.push_style_color(imgui.Col_.button, ImVec4(*LACQUER, 0.9))
    pressed: bool = imgui.button(label)
    if on:
        imgui.pop_style_color()
    return pressed


def _precise(seconds: float) -> str:
    """Minutes, seconds and tenths, as 1:05.3."""
    minutes, rest = divmod(max(seconds, 0.0), 60.0)
    return f"{int(minutes)}:{rest:04.1f}"
