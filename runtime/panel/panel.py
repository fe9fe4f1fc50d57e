"""The panel: everything over the picture in the window."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from runtime.control.show_controls import ShowControls
from runtime.panel.bar import draw_bar
from runtime.panel.gui import Gui
from runtime.panel.keys_page import draw_keys
from runtime.panel.legend import draw_legend
from runtime.panel.sliders import draw_sliders
from runtime.panel.status_card import draw_countdown, draw_notices, draw_status
from runtime.status.show_status import ShowStatus

if TYPE_CHECKING:
    import moderngl

READ = 15.0  # times a second that the state of the show is read
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
        self._shown: ShowStatus | None = None
        self._read = -math.inf

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
        if controls.view.help:
            draw_keys(controls, margin, scale)
            return
        above = margin
        if controls.view.panel:
            inset = 0.0 if controls.scene is None else controls.scene.inset_side
            draw_status(status, inset + margin, scale, margin)
            above = draw_bar(status, controls, margin, scale)
            draw_legend(status, controls, margin, scale, inset, above)
            if controls.view.sliders:
                draw_sliders(controls, margin, scale)
        draw_countdown(status, scale)
        draw_notices(controls.notices.current, above, scale)

    def _newest_status(self) -> ShowStatus:
        """The state of the show, read as often as anybody could follow."""
        if self._shown is None or self._drawn - self._read > 1.0 / READ:
            self._shown, self._read = self._status(), self._drawn
        return self._shown
