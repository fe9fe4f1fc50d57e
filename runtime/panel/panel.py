"""The panel: everything over the picture in the window."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from runtime.control.ramp import Ramp
from runtime.control.show_controls import ShowControls
from runtime.panel.bar import draw_bar
from runtime.panel.choosing_card import draw_choosing
from runtime.panel.gui import Gui
from runtime.panel.keys_page import draw_keys
from runtime.panel.legend import WIDTH as LEGEND
from runtime.panel.legend import draw_legend
from runtime.panel.match_pictures import MatchPictures
from runtime.panel.sliders import WIDTH as SLIDERS
from runtime.panel.sliders import draw_sliders
from runtime.panel.status_card import LEAST as STATUS_LEAST
from runtime.panel.status_card import draw_countdown, draw_hands_free, draw_notices, draw_status
from runtime.panel.timeline import Timeline
from runtime.status.show_status import ShowStatus

if TYPE_CHECKING:
    import moderngl

READ = 15.0  # times a second that the state of the show is read
UNFOLDS = 0.25  # [s] in which the stage makes room for the panel
MARGIN = 14.0  # [px] in a picture of the usual height


class Panel:
    """Draws the panel over the picture in the window, and does what is pressed on it.

    Args:
        context: the window's OpenGL context.
        controls: what the actions change.
        status: tells the state of the show.
        clock: host monotonic time [s].

    Attributes:
        gui: takes the window's input.
    """

    def __init__(
        self,
        context: moderngl.Context,
        controls: ShowControls,
        status: Callable[[], ShowStatus],
        *,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.gui = Gui(context)
        self._controls, self._status = controls, status
        self._clock = clock
        self._drawn = clock()
        self._timeline = Timeline()
        self._matches = MatchPictures()
        self._shown: ShowStatus | None = None
        self._read = -math.inf
        self._taken = (0.0, 0.0, 0.0, 0.0)
        self._sides = [Ramp(UNFOLDS, clock) for _ in self._taken]

    def draw(self, target: moderngl.Framebuffer) -> None:
        """Lay out the panel, do what is pressed on it, and draw it over `target`."""
        now = self._clock()
        self.gui.begin(target.size, now - self._drawn)
        self._drawn = now
        self._lay_out()
        self.gui.draw(target)

    def close(self) -> None:
        """Free everything; the window's OpenGL context must be current."""
        self.gui.close()

    def _lay_out(self) -> None:
        status, controls, scale = self._newest_status(), self._controls, self.gui.scale
        margin = MARGIN * scale
        self._take_room()
        end = 0.0
        if controls.view.help:
            draw_keys(controls, margin)
        elif controls.view.panel:
            end = self._lay_cards(status, margin)
        else:
            draw_notices(controls.notices.current, margin, scale)
            draw_hands_free(status, margin, scale)
        if not controls.view.help:
            draw_countdown(status, end, scale)

    def _lay_cards(self, status: ShowStatus, margin: float) -> float:
        """Lay out the cards along the borders of the picture; note how much of it they take.

        Return where the card at the top ends [px].
        """
        controls, scale = self._controls, self.gui.scale
        screen, sliders = imgui.get_io().display_size, controls.view.sliders
        inset = 0.0 if controls.scene is None else controls.scene.inset_side
        left, right = inset + margin, margin
        column = margin + SLIDERS * scale
        beside = sliders and screen.x - left - column - margin >= STATUS_LEAST * scale
        width = screen.x - left - right - (column if beside else 0.0)
        below, end = draw_status(status, controls.notices.current, left, width, margin, scale)
        above = draw_bar(status, controls, margin, scale)
        if controls.session is not None:
            above += self._timeline.draw(controls, margin, above - margin, scale)
        if controls.chooser.on:
            above += draw_choosing(controls, margin, above - margin, scale)
        matches = self._matches.draw(status, controls, margin, above, scale)
        between = self._matches.left > margin + LEGEND * scale  # the columns at the sides
        beneath, above = above, above + matches
        draw_legend(status, controls, margin, scale, inset, beneath if between else above)
        if sliders:
            top = margin if beside else below + margin
            draw_sliders(controls, margin, scale, top, beneath if between else above)
        self._taken = (
            max(inset, margin + LEGEND * scale) / screen.x,
            column / screen.x if sliders else 0.0,
            below / screen.y,
            (above - margin) / screen.y,
        )
        return end

    def _take_room(self) -> None:
        """Let the scene draw all that is framed clear of the panel, as far as it has unfolded."""
        scene, shown = self._controls.scene, self._controls.view.panel
        if scene is None:
            return
        for ramp, share in zip(self._sides, self._taken, strict=True):
            wanted = min(share, 1.0) if shown else 0.0
            if ramp.target != wanted:
                ramp.to(wanted)
        left, right, top, bottom = (ramp.level for ramp in self._sides)
        scene.taken = (left, right, top, bottom)

    def _newest_status(self) -> ShowStatus:
        """The state of the show, read as often as anybody could follow."""
        if self._shown is None or self._drawn - self._read > 1.0 / READ:
            self._shown, self._read = self._status(), self._drawn
        return self._shown
