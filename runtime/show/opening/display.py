"""Where a show is drawn: a window with its panel, an OpenGL context without one, or nowhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

from devices.skeleton import Skeleton
from runtime.control.audience_window import AudienceWindow
from runtime.control.keys import WindowControls
from runtime.control.pin_lock import PinLock
from runtime.control.show_controls import ShowControls
from runtime.control.window import InputTaker, Window, leave_windows
from runtime.puppet.puppet import Puppet
from runtime.render.context import headless_context, make_current, release_headless
from runtime.show.scene import Scene
from runtime.show.settings import ShowSettings
from runtime.status.show_status import ShowStatus

if TYPE_CHECKING:
    import moderngl


class Display:
    """The window of a show or the context that it draws with, if it has one.

    Args:
        settings: of the show. Its window is opened here.
        context: where to draw without a window; None to make one if the settings need pictures.
        closing: closes what was opened.
        clock: host monotonic time [s].

    Attributes:
        window: None without one.
        shown: whether somebody or something sees the pictures, and not only outputs.

    Raises:
        InputError: no window or context can be opened.
    """

    def __init__(
        self,
        settings: ShowSettings,
        context: moderngl.Context | None,
        closing: ExitStack,
        clock: Callable[[], float],
    ) -> None:
        self._settings, self._closing, self._clock = settings, closing, clock
        self.window = self._open_window()
        self._context = context if self.window is None else self.window.context
        self.shown = self._context is not None

    def make_current(self) -> None:
        """Make the OpenGL context current, if there is one; another show may have drawn since."""
        if self.window is not None:
            self.window.make_current()
        elif self._context is not None:
            leave_windows()
            make_current(self._context)

    def open_scene(
        self, make_scene: Callable[..., Scene], puppets: Sequence[Puppet], performer: Skeleton
    ) -> Scene | None:
        """Open what draws the show; None where nothing is drawn.

        Args:
            make_scene: makes the scene.
            puppets: the characters in it.
            performer: the performer's skeleton, for the inset.
        """
        settings = self._settings
        size = settings.size if self.window is None else self.window.size
        if self._context is None and settings.needs_pictures:
            leave_windows()
            self._context = headless_context()
            self._closing.callback(release_headless, self._context)
        if self._context is None:
            return None
        self.make_current()
        scene = make_scene(
            self._context,
            size,
            puppets,
            performer,
            background=settings.background,
            plain=settings.plain,
            clock=self._clock,
        )
        self._closing.callback(scene.close)
        self._closing.callback(self.make_current)
        return scene

    def open_controls(
        self, scene: Scene | None, controls: ShowControls, status: Callable[[], ShowStatus]
    ) -> WindowControls | None:
        """Open the window's keys, mouse and panel; None without a window.

        Args:
            scene: what the window shows.
            controls: the parts of the show that actions change.
            status: returns the state of the show, for the panel.
        """
        if self.window is None or scene is None:
            return None
        from runtime.panel.panel import Panel  # noqa: PLC0415  # no headless show needs ImGui

        panel = Panel(self.window.context, controls, status, clock=self._clock)
        self._closing.callback(panel.close)
        self.window.taker = self._locked(panel.gui, controls)
        audience = AudienceWindow(self.window, transparent=self._settings.transparent)
        self._closing.callback(audience.close)
        return WindowControls(self.window, scene, controls, panel, audience)

    def _locked(self, taker: InputTaker, controls: ShowControls) -> InputTaker:
        """What takes the window's input, behind a lock where there is a PIN."""
        kiosk = self._settings.kiosk
        if kiosk is None or not kiosk.pin:
            return taker
        return PinLock(taker, kiosk.pin, clock=self._clock, tell=controls.notices.show)

    def _open_window(self) -> Window | None:
        settings = self._settings
        if not settings.window:
            return None
        window = Window("Bunraku", settings.size, transparent=settings.transparent)
        return self._closing.enter_context(window)
