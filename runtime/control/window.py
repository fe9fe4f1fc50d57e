"""The desktop window: its OpenGL context, the camera that the mouse moves, and the keys typed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol
from weakref import WeakSet

import glfw
import moderngl

from devices.errors import InputError
from runtime.render.camera import Camera, front_camera
from runtime.render.context import current_context, leave_headless

ORBIT_SPEED = 0.006  # rad a pixel
CLICK = 4.0  # px that the mouse may move between press and release of a click
ZOOM_STEP = 1.12  # a notch of the wheel


CONTEXT_HINTS: dict[int, int] = {
    glfw.CONTEXT_VERSION_MAJOR: 3,
    glfw.CONTEXT_VERSION_MINOR: 3,
    glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
    glfw.OPENGL_FORWARD_COMPAT: True,
    glfw.SAMPLES: 0,  # the stage has its own multisampling
}


@dataclass(frozen=True, slots=True)
class KeyPressed:
    """A key went down or repeats.

    Attributes:
        key: the character printed on it, in lower case, or a name in `KEY_NAMES`.
        shift, control: whether that modifier was down.
        again: whether the key was down already and repeats.
    """

    key: str
    shift: bool = False
    control: bool = False
    again: bool = False


@dataclass(frozen=True, slots=True)
class Resized:
    """The window's framebuffer has another size [px]."""

    size: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Pointed:
    """The mouse has moved to a place of the framebuffer [px] from the upper left corner."""

    at: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Clicked:
    """The left button was pressed and let go at a place, as of `Pointed`."""

    at: tuple[float, float]


Event = KeyPressed | Resized | Pointed | Clicked


class InputTaker(Protocol):
    """Takes the window's input first, such as a panel; returns whether it keeps it for itself."""

    def key(self, name: str, *, down: bool, shift: bool, control: bool) -> bool:
        """Take a key, by its name in `KeyPressed`."""
        ...

    def letter(self, character: str) -> bool:
        """Take a typed character."""
        ...

    def button(self, button: int, *, down: bool) -> bool:
        """Take a button of the mouse: 0 left, 1 right, 2 middle."""
        ...

    def cursor(self, x: float, y: float) -> bool:
        """Take the place of the mouse [px of the framebuffer] from the upper left corner."""
        ...

    def scroll(self, right: float, up: float) -> bool:
        """Take notches of the wheel."""
        ...


SIGNS = "?"  # typed characters that are keys, on whatever key a keyboard has them

KEY_NAMES = {
    glfw.KEY_SPACE: "space",
    glfw.KEY_ESCAPE: "escape",
    glfw.KEY_ENTER: "enter",
    glfw.KEY_TAB: "tab",
    glfw.KEY_BACKSPACE: "backspace",
    glfw.KEY_DELETE: "delete",
    glfw.KEY_LEFT: "left",
    glfw.KEY_RIGHT: "right",
    glfw.KEY_UP: "up",
    glfw.KEY_DOWN: "down",
    glfw.KEY_HOME: "home",
    glfw.KEY_END: "end",
    glfw.KEY_PAGE_UP: "page-up",
    glfw.KEY_PAGE_DOWN: "page-down",
    **{getattr(glfw, f"KEY_F{number}"): f"f{number}" for number in range(1, 13)},
}


class Window:
    """A window with an OpenGL 3.3 context, current on this thread.

    The left button orbits the camera, the right or middle one pans, the wheel zooms.

    Args:
        title: text of its title bar.
        size: width and height [px].
        visible: whether it appears on the screen.
        transparent: let the desktop show through where the picture's alpha is low; needs a
            compositing window manager, without one such pixels are black.

    Attributes:
        camera: the camera that the mouse moves; may be set.
        taker: takes input before the window does; None for nothing.
        context: the window's GL context.
        handle: glfw's window; None after `close`.

    Raises:
        InputError: there is no display, or no OpenGL 3.3 on it.
    """

    def __init__(
        self,
        title: str,
        size: tuple[int, int],
        *,
        visible: bool = True,
        transparent: bool = False,
    ) -> None:
        hints = {glfw.VISIBLE: visible, glfw.TRANSPARENT_FRAMEBUFFER: transparent}
        self.handle: Any = _open_window(title, size, hints)
        try:
            self.context: moderngl.Context = current_context(glfw.get_proc_address)
        except InputError:
            glfw.destroy_window(self.handle)
            raise
        _windows.add(self)
        self.camera: Camera = front_camera()
        self.taker: InputTaker | None = None
        self._windowed: tuple[int, int, int, int] | None = None
        self._events: list[Event] = []
        self._cursor = glfw.get_cursor_pos(self.handle)
        self._dragging: int | None = None
        self._pressed_at: tuple[float, float] | None = None
        glfw.swap_interval(1)
        glfw.set_key_callback(self.handle, self.on_key)
        glfw.set_char_callback(self.handle, self._on_letter)
        glfw.set_mouse_button_callback(self.handle, self._on_button)
        glfw.set_cursor_pos_callback(self.handle, self._on_cursor)
        glfw.set_scroll_callback(self.handle, self._on_scroll)
        glfw.set_framebuffer_size_callback(self.handle, self._on_resize)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the framebuffer [px]; larger than the window on dense displays."""
        width, height = glfw.get_framebuffer_size(self.handle)
        return max(width, 1), max(height, 1)

    @property
    def framebuffer(self) -> moderngl.Framebuffer:
        """The framebuffer that `swap` shows."""
        return self.context.screen

    @property
    def monitor(self) -> Any:
        """The screen that most of the window is on; None without any."""
        place = (*glfw.get_window_pos(self.handle), *glfw.get_window_size(self.handle))
        return _monitor_under(place)

    @property
    def should_close(self) -> bool:
        """Whether the user asked to close the window."""
        return bool(glfw.window_should_close(self.handle))

    @property
    def full_screen(self) -> bool:
        """Whether the window fills the screen that most of it is on."""
        return self._windowed is not None

    @full_screen.setter
    def full_screen(self, on: bool) -> None:
        if on and self._windowed is None:
            place = (*glfw.get_window_pos(self.handle), *glfw.get_window_size(self.handle))
            monitor = self.monitor
            if monitor is None:
                return
            mode = glfw.get_video_mode(monitor)
            self._windowed = place
            width, height = mode.size
            glfw.set_window_monitor(self.handle, monitor, 0, 0, width, height, mode.refresh_rate)
        elif not on and self._windowed is not None:
            nothing: Any = None  # which glfw takes, though its types do not say so
            glfw.set_window_monitor(self.handle, nothing, *self._windowed, 0)
            self._windowed = None

    def make_current(self) -> None:
        """Make the window's context current on this thread, and no headless one."""
        leave_headless()
        glfw.make_context_current(self.handle)

    def poll(self) -> list[Event]:
        """Move the camera by the mouse; return all other events, oldest first."""
        glfw.poll_events()
        events, self._events = self._events, []
        return events

    def swap(self) -> None:
        """Show the framebuffer on the screen."""
        glfw.swap_buffers(self.handle)

    def close(self) -> None:
        """Close the window; its context ends with it."""
        if self.handle is not None:
            glfw.destroy_window(self.handle)
            self.handle = None
            _windows.discard(self)

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def on_key(self, _: object, key: int, scancode: int, action: int, mods: int) -> None:
        """Take a key from glfw, of this window or another."""
        name = KEY_NAMES.get(key) or glfw.get_key_name(key, scancode)
        if not name:
            return
        down, again = action != glfw.RELEASE, action == glfw.REPEAT
        shift, control = bool(mods & glfw.MOD_SHIFT), bool(mods & glfw.MOD_CONTROL)
        if self.taker is not None and self.taker.key(
            name.lower(), down=down, shift=shift, control=control
        ):
            return
        if down:
            self._events.append(KeyPressed(name.lower(), shift, control, again))

    def _on_letter(self, _: object, code: int) -> None:
        if self.taker is not None and self.taker.letter(chr(code)):
            return
        if chr(code) in SIGNS:
            self._events.append(KeyPressed(chr(code)))

    def _on_button(self, _: object, button: int, action: int, mods: int) -> None:
        down = action != glfw.RELEASE
        if self.taker is not None and self.taker.button(button, down=down):
            return
        if not down:
            self._dragging, pressed_at, self._pressed_at = None, self._pressed_at, None
            if pressed_at is not None and button == glfw.MOUSE_BUTTON_LEFT:
                self._events.append(Clicked(self._in_pixels(*pressed_at)))
            return
        shifted = button == glfw.MOUSE_BUTTON_LEFT and mods & glfw.MOD_SHIFT
        self._dragging = glfw.MOUSE_BUTTON_MIDDLE if shifted else button
        self._pressed_at = self._cursor if button == glfw.MOUSE_BUTTON_LEFT else None

    def _on_cursor(self, _: object, x: float, y: float) -> None:
        right, down = x - self._cursor[0], y - self._cursor[1]
        self._cursor = (x, y)
        if self._pressed_at is not None and (
            abs(x - self._pressed_at[0]) > CLICK or abs(y - self._pressed_at[1]) > CLICK
        ):
            self._pressed_at = None
        place = self._in_pixels(x, y)
        if self.taker is not None and self.taker.cursor(*place):
            return
        self._events.append(Pointed(place))
        if self._dragging is None:
            return
        if self._dragging == glfw.MOUSE_BUTTON_LEFT:
            self.camera = self.camera.orbit(-ORBIT_SPEED * right, ORBIT_SPEED * down)
        else:
            height = max(glfw.get_window_size(self.handle)[1], 1)
            self.camera = self.camera.pan(-right / height, down / height)

    def _in_pixels(self, x: float, y: float) -> tuple[float, float]:
        """A place of the window in pixels of its framebuffer."""
        dense = self.size[0] / max(glfw.get_window_size(self.handle)[0], 1)
        return dense * x, dense * y

    def _on_scroll(self, _: object, right: float, up: float) -> None:
        if self.taker is None or not self.taker.scroll(right, up):
            self.camera = self.camera.zoom(ZOOM_STEP**up)

    def _on_resize(self, _: object, width: int, height: int) -> None:
        self._events.append(Resized((max(width, 1), max(height, 1))))


_windows: WeakSet[Window] = WeakSet()


def leave_windows() -> None:
    """Make no window's context current: EGL refuses a thread on which one still is."""
    if _windows:
        nothing: Any = None  # which glfw takes, though its types do not say so
        glfw.make_context_current(nothing)


def _monitor_under(place: tuple[int, int, int, int]) -> Any:
    """The screen that holds most of a window at (left, top, width, height); None without any."""
    left, top, width, height = place

    def shared(monitor: Any) -> int:
        x, y = glfw.get_monitor_pos(monitor)
        size = glfw.get_video_mode(monitor).size
        across = min(left + width, x + size.width) - max(left, x)
        down = min(top + height, y + size.height) - max(top, y)
        return max(across, 0) * max(down, 0)

    return max(glfw.get_monitors(), key=shared, default=None)


def _open_window(title: str, size: tuple[int, int], hints: Mapping[int, bool]) -> Any:
    """Open a glfw window and make its context current."""
    problems: list[str] = []
    report: Any = lambda _code, text: problems.append(text.decode("utf-8", "replace"))  # noqa: E731  # a lambda fits GLFW's untyped callback
    glfw.set_error_callback(report)
    leave_headless()
    handle = None
    if glfw.init():
        for hint, value in ({**CONTEXT_HINTS, **hints}).items():
            glfw.window_hint(hint, value)
        handle = glfw.create_window(*size, title, None, None)
    if not handle:
        reason = problems[-1] if problems else "no reason given"
        raise InputError(f"could not open a window ({reason}); add --headless to go without one")
    glfw.make_context_current(handle)
    return handle
