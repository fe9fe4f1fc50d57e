"""Pictures over the network by NDI, a source for OBS, vMix and video mixers; uses cyndilib."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from devices.errors import InputError
from runtime.output.pictures import Picture


class NdiSender:
    """An NDI source of pictures: RGBA with straight alpha, or RGBX for opaque pictures.

    Source: the NDI SDK's documentation of video frames: rows from the top, alpha not
    premultiplied.

    Args:
        name: the name of the source.
        size: width and height [px].
        rate: approximate pictures per second.
        alpha: whether pictures have transparent areas.

    Raises:
        InputError: the library is missing or does not start.
    """

    def __init__(self, name: str, size: tuple[int, int], rate: float, *, alpha: bool) -> None:
        library = import_cyndilib()
        frame = library.VideoSendFrame()
        frame.set_resolution(*size)
        frame.set_frame_rate(Fraction(rate).limit_denominator(1001))
        frame.set_fourcc(library.FourCC.RGBA if alpha else library.FourCC.RGBX)
        # With its clock, the library would make the show wait to keep the frame rate.
        self._sender: Any = library.Sender(name, clock_video=False, clock_audio=False)
        self._sender.set_video_frame(frame)
        try:
            self._sender.open()
        except Exception as error:  # the library raises MemoryError, AttributeError and Exception
            raise InputError(
                f"NDI does not start here ({error!r}); another source may be called {name!r}"
            ) from error

    def send(self, picture: Picture) -> None:
        """Send a picture (H, W, 4); the library encodes it on its own threads."""
        self._sender.write_video_async(np.ascontiguousarray(picture).reshape(-1))

    def close(self) -> None:
        """Remove the source."""
        self._sender.close()


def import_cyndilib() -> Any:
    """Import the library.

    Raises:
        InputError: it is missing, or does not support this machine.
    """
    try:
        import cyndilib  # noqa: PLC0415  # an optional extra
        import cyndilib.wrapper  # noqa: PLC0415  # an optional extra
    except (ImportError, OSError) as error:
        raise InputError("--ndi needs the extra: pip install 'bunraku[ndi]'") from error
    return cyndilib
