"""The audience's window: the show alone, on a second screen where there is one."""

from __future__ import annotations

from typing import Any

import glfw

from runtime.control.window import CONTEXT_HINTS, Window
from runtime.render.context import current_context
from runtime.render.shared_picture import PictureScreen, SharedPicture
from runtime.render.stage import Stage

TITLE = "Bunraku, for the audience"


class AudienceWindow:
    """A second window that shares the pictures of the first.

    It fills the first screen that the operator's window is not on; on a single screen it is a
    window as large as the picture. Its keys do what those of the operator's window do.

    Args:
        window: the operator's.
        transparent: as of the operator's window.
    """

    def __init__(self, window: Window, *, transparent: bool = False) -> None:
        self._window, self._transparent = window, transparent
        self._handle: Any = None
        self._screen: PictureScreen | None = None
        self._picture: SharedPicture | None = None

    @property
    def on(self) -> bool:
        """Whether it is open; it stays closed where no window can be opened."""
        return self._handle is not None

    @on.setter
    def on(self, on: bool) -> None:
        if on and self._handle is None:
            self._open()
        elif not on:
            self.close()

    @property
    def should_close(self) -> bool:
        """Whether the user asked to close it."""
        return self._handle is not None and bool(glfw.window_should_close(self._handle))

    def show(self, stage: Stage) -> None:
        """Show a stage's picture in it; the operator's context is current before and after."""
        if self._handle is None or self._screen is None:
            return
        if self._picture is None or self._picture.image.size != stage.size:
            if self._picture is not None:
                self._picture.release()
            self._picture = SharedPicture(self._window.context, stage.size)
        self._picture.take(stage)
        glfw.make_context_current(self._handle)
        width, height = glfw.get_framebuffer_size(self._handle)
        self._screen.show(self._picture, (max(width, 1), max(height, 1)))
        glfw.swap_buffers(self._handle)
        self._window.make_current()

    def close(self) -> None:
        """Close it; the operator's context is current afterwards."""
        if self._handle is None:
            return
        if self._picture is not None:
            self._picture.release()
        glfw.destroy_window(self._handle)  # its context and all in it end with it
        self._handle = self._screen = self._picture = None
        self._window.make_current()

    def _open(self) -> None:
        monitor = self._other_monitor()
        size = self._window.size
        nothing: Any = None  # which glfw takes, though its types do not say so
        hints = {**CONTEXT_HINTS, glfw.TRANSPARENT_FRAMEBUFFER: self._transparent}
        if monitor is not nothing:
            mode = glfw.get_video_mode(monitor)
            size = (mode.size.width, mode.size.height)
            hints[glfw.REFRESH_RATE] = mode.refresh_rate
        for hint, value in hints.items():
            glfw.window_hint(hint, value)
        handle = glfw.create_window(*size, TITLE, monitor, self._window.handle)
        if not handle:
            return
        self._handle = handle
        glfw.make_context_current(handle)
        glfw.swap_interval(0)  # the operator's window waits for its own screen
        self._screen = PictureScreen(current_context(glfw.get_proc_address))
        glfw.set_key_callback(handle, self._window.on_key)
        self._window.make_current()

    def _other_monitor(self) -> Any:
        """The first screen that the operator's window is not on; None for no such screen."""
        own = self._window.monitor
        others = [monitor for monitor in glfw.get_monitors() if monitor != own]
        return others[0] if own is not None and others else None
