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
from runtime.panel.gui import Gui
from runtime.panel.keys_page import draw_keys
from runtime.panel.legend import WIDTH as LEGEND
from runtime.panel.legend import draw_legend
from runtime.panel.sliders import WIDTH as SLIDERS
from runtime.panel.sliders import draw_sliders
from runtime.panel.status_card import HEIGHT as STATUS_HEIGHT
from runtime.panel.status_card import draw_countdown, draw_notices, draw_status
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
        self._shown: ShowStatus | None = None
        self._read = -math.inf
        self._above = 0.0
        self._panel, self._sliders = Ramp(UNFOLDS, clock), Ramp(UNFOLDS, clock)

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
        inset = 0.0 if controls.scene is None else controls.scene.inset_side
        self._take_room(margin)
        if controls.view.help:
            draw_keys(controls, margin + inset, margin, scale)
            return
        above = margin
        if controls.view.panel:
            draw_status(status, inset + margin, scale, margin)
            above = draw_bar(status, controls, margin, scale)
            if controls.session is not None:
                above += self._timeline.draw(controls, margin, above - margin, scale)
            self._above = above
            draw_legend(status, controls, margin, scale, inset, above)
            if controls.view.sliders:
                draw_sliders(controls, margin, scale, above)
        draw_countdown(status, scale)
        draw_notices(controls.notices.current, above, scale)

    def _take_room(self, margin: float) -> None:
        """Let the scene draw all that is framed clear of the panel, as much as it is shown now."""
        view, scene, scale = self._controls.view, self._controls.scene, self.gui.scale
        if scene is None:
            return
        for ramp, on in ((self._panel, view.panel), (self._sliders, view.panel and view.sliders)):
            if ramp.target != on:
                ramp.to(float(on))
        width, height = imgui.get_io().display_size
        panel, sliders = self._panel.level, self._sliders.level
        left = panel * max(scene.inset_side, margin + LEGEND * scale)
        top = panel * (margin + STATUS_HEIGHT * scale)
        right = sliders * (margin + SLIDERS * scale)
        bottom = panel * (self._above - margin)
        scene.taken = (left / width, right / width, top / height, bottom / height)

    def _newest_status(self) -> ShowStatus:
        """The state of the show, read as often as anybody could follow."""
        if self._shown is None or self._drawn - self._read > 1.0 / READ:
            self._shown, self._read = self._status(), self._drawn
        return self._shown
