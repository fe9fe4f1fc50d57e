"""OpenGL 3.3 contexts: a headless one through EGL, and one that wraps a window's context."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any
from weakref import WeakSet

import moderngl

from devices.errors import InputError

INSTALL_HINT = "on Debian or Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri"
_headless: WeakSet[moderngl.Context] = WeakSet()
_QUIET = {"EGL_LOG_LEVEL": "fatal", "MESA_LOG": "null"}  # or Mesa writes to the terminal
EGL_DEVICES = 4  # devices that are tried; GPUs come first and Mesa's software device last


def headless_context(*, libegl: str = "libEGL.so.1", libgl: str = "libGL.so.1") -> moderngl.Context:
    """Return an OpenGL 3.3 core context without a display, on a GPU or on Mesa's llvmpipe.

    On Linux it loads EGL by the library names of a plain Debian; on Windows and macOS moderngl
    makes a hidden window. An EGL device that refuses (no permission, no driver) is skipped.
    End the context with `release_headless`.

    Raises:
        InputError: EGL, GL or a driver is missing; the message names the packages to install.
    """
    if not sys.platform.startswith("linux"):
        return _other_platform()
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    egl: dict[str, Any] = {"backend": "egl", "libegl": libegl, "libgl": libgl}
    refusals = []
    for device in range(EGL_DEVICES):
        egl["device_index"] = device
        try:
            context = moderngl.create_context(standalone=True, **egl)
        except Exception as error:  # glcontext raises bare Exception for every failure
            refusals.append(str(error))
        else:
            _headless.add(context)
            return context
    raise InputError(
        f"headless rendering could not start OpenGL 3.3 through EGL ({refusals[0]}); {INSTALL_HINT}"
    )


def make_current(context: moderngl.Context) -> None:
    """Make a context current on this thread; no window's may be."""
    enter: Callable[[], object] = context.__enter__
    enter()


def leave_headless() -> None:
    """Make no headless context current; otherwise X11 ends a process that opens a window."""
    for context in _headless:
        leave: Callable[..., None] = context.__exit__
        leave(None, None, None)


def release_headless(context: moderngl.Context) -> None:
    """Release a context of `headless_context`; a plain release would leave it current."""
    leave_headless()
    _headless.discard(context)
    context.release()


def _other_platform() -> moderngl.Context:
    try:
        context = moderngl.create_context(standalone=True)
    except Exception as error:  # glcontext raises bare Exception for every failure
        raise InputError(
            f"headless rendering could not start OpenGL 3.3 ({error}); update the graphics driver"
        ) from error
    _headless.add(context)
    return context


class _Loader:
    """Looks up GL functions in the library that made the current context."""

    def __init__(self, address_of: Callable[[str], Any]) -> None:
        self._address_of = address_of

    def load_opengl_function(self, name: str) -> int:
        return int(self._address_of(name) or 0)

    def release(self) -> None:
        """Do nothing: the window owns the context and ends it."""


def current_context(address_of: Callable[[str], Any]) -> moderngl.Context:
    """Wrap the GL context that is current on this thread; `address_of` finds GL functions.

    Raises:
        InputError: the current context is older than OpenGL 3.3.
    """
    try:
        loader: Any = _Loader(address_of)
        return moderngl.create_context(context=loader)
    except Exception as error:  # moderngl raises bare Exception for every failure
        raise InputError(
            f"the window's OpenGL is not usable ({error}); Bunraku needs OpenGL 3.3: "
            "update the graphics driver or add --headless"
        ) from error


def renderer_name(context: moderngl.Context) -> str:
    """Return the driver's name for the renderer, and its OpenGL version, in one line."""
    with suppress(KeyError):
        return f"{context.info['GL_RENDERER']}, OpenGL {context.info['GL_VERSION']}"
    return "unknown renderer"


def is_software(context: moderngl.Context) -> bool:
    """Return whether the CPU draws instead of a GPU."""
    name = renderer_name(context).lower()
    return any(word in name for word in ("llvmpipe", "softpipe", "swrast", "software"))
