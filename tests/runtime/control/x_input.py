"""Real keys and a real mouse for a window on an X display, by the XTEST extension."""

from __future__ import annotations

import ctypes
import os

import glfw

KEYSYMS = {"space": 0x20, "escape": 0xFF1B, "home": 0xFF50, "delete": 0xFFFF, "f2": 0xFFBF}
KEYSYMS |= {"enter": 0xFF0D, "end": 0xFF57, "f6": 0xFFC3, "f8": 0xFFC5, "f10": 0xFFC7}


class XInput:
    """Presses keys and moves the mouse, as a person does.

    Args:
        window: glfw's window, which gets the keys.

    Raises:
        OSError: this machine has no Xlib, or no XTEST.
    """

    def __init__(self, window: object) -> None:
        self._x = ctypes.CDLL("libX11.so.6")
        self._test = ctypes.CDLL("libXtst.so.6")
        for name in ("XOpenDisplay", "XKeysymToKeycode", "XSetInputFocus", "XFlush", "XSync"):
            getattr(self._x, name).restype = ctypes.c_long
        self._x.XOpenDisplay.restype = ctypes.c_void_p
        self._display = ctypes.c_void_p(self._x.XOpenDisplay(os.environ["DISPLAY"].encode()))
        if not self._display:
            raise OSError("no X display")
        self._window = window
        handle = glfw.get_x11_window(window)
        self._x.XSetInputFocus(self._display, ctypes.c_ulong(handle), 1, ctypes.c_ulong(0))
        self._x.XSync(self._display, 0)

    def key(self, name: str) -> None:
        """Press a key and let it go."""
        symbol = KEYSYMS.get(name) or ord(name)
        code = self._x.XKeysymToKeycode(self._display, ctypes.c_ulong(symbol))
        for down in (1, 0):
            self._test.XTestFakeKeyEvent(self._display, code & 0xFF, down, ctypes.c_ulong(0))
        self._x.XSync(self._display, 0)

    def move(self, x: float, y: float) -> None:
        """Move the mouse to a place of the window [px]."""
        left, top = glfw.get_window_pos(self._window)
        place = (round(left + x), round(top + y))
        self._test.XTestFakeMotionEvent(self._display, -1, *place, ctypes.c_ulong(0))
        self._x.XSync(self._display, 0)

    def button(self, down: bool) -> None:
        """Press the left button, or let it go."""
        self._test.XTestFakeButtonEvent(self._display, 1, int(down), ctypes.c_ulong(0))
        self._x.XSync(self._display, 0)
