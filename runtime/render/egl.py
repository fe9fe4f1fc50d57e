"""List the EGL devices of a machine, without making a GL context."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from devices.errors import InputError
from runtime.render.context import INSTALL_HINT

MOST_DEVICES = 16
_PLATFORM_DEVICE = 0x313F  # EGL_PLATFORM_DEVICE_EXT
_VENDOR, _VERSION = 0x3053, 0x3054


@dataclass(frozen=True, slots=True)
class EglDevice:
    """An EGL device; vendor and version are empty where it refuses to initialise."""

    vendor: str
    version: str


def egl_devices(library: str = "libEGL.so.1") -> list[EglDevice]:
    """Return the devices in EGL's order: GPUs first, Mesa's software device last.

    Raises:
        InputError: EGL is missing, or cannot list its devices.
    """
    try:
        egl = ctypes.CDLL(library)
    except OSError as error:
        raise InputError(f"{library} is not here ({error}); {INSTALL_HINT}") from error
    query = _extension(egl, b"eglQueryDevicesEXT", ctypes.c_uint)
    display_of = _extension(egl, b"eglGetPlatformDisplayEXT", ctypes.c_void_p)
    if query is None or display_of is None:
        raise InputError(f"EGL cannot list its devices; {INSTALL_HINT}")
    devices = (ctypes.c_void_p * MOST_DEVICES)()
    count = ctypes.c_int()
    if not query(MOST_DEVICES, devices, ctypes.byref(count)):
        raise InputError(f"EGL does not list its devices; {INSTALL_HINT}")
    return [_device(egl, display_of, device) for device in devices[: count.value]]


def _extension(egl: ctypes.CDLL, name: bytes, result: type) -> Callable[..., Any] | None:
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = (ctypes.c_char_p,)
    address = egl.eglGetProcAddress(name)
    return ctypes.CFUNCTYPE(result, *_ARGUMENTS[name])(address) if address else None


_ARGUMENTS: dict[bytes, tuple[type, ...]] = {
    b"eglQueryDevicesEXT": (ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p),
    b"eglGetPlatformDisplayEXT": (ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p),
}


def _device(egl: ctypes.CDLL, display_of: Callable[..., Any], device: int | None) -> EglDevice:
    # The display stays initialised: a context elsewhere in the process may use it.
    display = ctypes.c_void_p(display_of(_PLATFORM_DEVICE, device, None))
    if not display or not egl.eglInitialize(display, None, None):
        return EglDevice("", "")
    egl.eglQueryString.restype = ctypes.c_char_p
    vendor, version = (
        (egl.eglQueryString(display, name) or b"").decode(errors="replace")
        for name in (_VENDOR, _VERSION)
    )
    return EglDevice(vendor, version)
