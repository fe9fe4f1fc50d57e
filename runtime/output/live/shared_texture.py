"""Pictures for other programs on this machine, by Spout (Windows) or Syphon (macOS)."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from devices.errors import InputError
from runtime.output.live.broadcast import Sender
from runtime.output.pictures import Picture, premultiplied

_GL_RGBA = 0x1908


class SpoutSender:
    """A Spout sender of RGBA pictures with straight alpha, as OBS's Spout source expects.

    It shares a texture of the OpenGL context that is current at the first picture.
    """

    def __init__(self, library: Any, name: str) -> None:
        self._name = name
        self._sender: Any = library.SpoutSender()
        self._sender.setSenderName(name)

    def send(self, picture: Picture) -> None:
        """Send a picture (H, W, 4)."""
        height, width = picture.shape[:2]
        data = np.ascontiguousarray(picture)
        is_upside_down = False
        if not self._sender.sendImage(data, width, height, _GL_RGBA, is_upside_down, 0):
            raise RuntimeError("the graphics driver shares no textures")
        self._sender.setFrameSync(self._name)

    def close(self) -> None:
        """Stop sharing."""
        self._sender.releaseSender()


class SyphonSender:
    """A Syphon server of RGBA pictures with premultiplied alpha, as its clients expect."""

    def __init__(self, library: Any, name: str, size: tuple[int, int]) -> None:
        self._raw = library.utils.raw
        self._server: Any = library.SyphonMetalServer(name)
        self._texture: Any = self._raw.create_mtl_texture(self._server.device, *size)

    def send(self, picture: Picture) -> None:
        """Send a picture (H, W, 4); Syphon's first row is at the bottom."""
        data = np.ascontiguousarray(premultiplied(picture)).tobytes()
        self._raw.copy_bytes_to_mtl_texture(data, self._texture)
        self._server.publish_frame_texture(self._texture, is_flipped=True)

    def close(self) -> None:
        """Stop sharing."""
        self._server.stop()


def open_shared_texture(
    name: str, size: tuple[int, int], *, platform: str = sys.platform
) -> Sender:
    """Open a sender of pictures of `size`, width and height [px], for this platform.

    Raises:
        InputError: this platform has none, or its library is missing or does not start.
    """
    library = import_shared_texture(platform)
    try:
        if platform == "darwin":
            return SyphonSender(library, name, size)
        return SpoutSender(library, name)
    except Exception as error:  # no Metal device, no graphics driver
        raise InputError(
            f"pictures cannot be shared here ({error}); update the graphics driver, or use --ndi"
        ) from error


def import_shared_texture(platform: str = sys.platform) -> Any:
    """Import the library for this platform.

    Raises:
        InputError: it is missing, or this platform has none.
    """
    if platform not in ("win32", "darwin"):
        raise InputError(
            "--spout shares pictures by Spout on Windows and by Syphon on macOS, "
            "and there is neither here; use --ndi or --virtual-camera"
        )
    try:
        if platform == "darwin":
            import syphon  # noqa: PLC0415  # an optional extra
            import syphon.utils.raw  # noqa: PLC0415  # an optional extra

            return syphon
        import SpoutGL  # noqa: PLC0415  # an optional extra
    except (ImportError, OSError) as error:
        raise InputError("--spout needs the extra: pip install 'bunraku[spout]'") from error
    return SpoutGL
