"""A virtual camera for video calls and OBS; uses pyvirtualcam."""

from __future__ import annotations

import sys
from typing import Any

from devices.errors import InputError
from runtime.output.pictures import Picture, on_black

_OBS = "install OBS, start its virtual camera once and stop it again"
_SETUP = {
    "linux": "install v4l2loopback and run: sudo modprobe v4l2loopback devices=1",
    "darwin": _OBS,
    "win32": f"{_OBS}, or install Unity Capture",
}


class VirtualCamera:
    """A virtual camera that shows pictures over black, as RGB.

    Args:
        name: a device such as ``/dev/video2`` or ``OBS Virtual Camera``; empty for the first one.
        size: width and height [px].
        rate: approximate pictures per second.

    Raises:
        InputError: the library is missing, or no such camera exists.
    """

    def __init__(self, name: str, size: tuple[int, int], rate: float) -> None:
        library = import_pyvirtualcam()
        try:
            self._camera: Any = library.Camera(
                width=size[0],
                height=size[1],
                fps=rate,
                fmt=library.PixelFormat.RGB,
                device=name or None,
            )
        except RuntimeError as error:  # all its backends raise this
            called = f" called {name!r}" if name else ""
            setup = _SETUP.get(sys.platform, _SETUP["linux"])
            raise InputError(
                f"there is no virtual camera{called} to send to ({error}); {setup}"
            ) from error

    def send(self, picture: Picture) -> None:
        """Show a picture (H, W, 4)."""
        self._camera.send(on_black(picture))

    def close(self) -> None:
        """Release the camera."""
        self._camera.close()


def import_pyvirtualcam() -> Any:
    """Import the library.

    Raises:
        InputError: it is missing.
    """
    try:
        import pyvirtualcam  # noqa: PLC0415  # an optional extra
    except (ImportError, OSError) as error:
        raise InputError(
            "--virtual-camera needs the extra: pip install 'bunraku[camera]'"
        ) from error
    return pyvirtualcam
