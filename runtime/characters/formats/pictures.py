"""Reads untrusted pictures: only PNG, JPEG and WebP, and bounded before they are decoded."""

from __future__ import annotations

import io
import struct
import threading
import warnings
import zlib

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from runtime.characters.formats.mesh_data import MeshError

MOST_PIXELS = 64 * 1024 * 1024
"""All textures of a character together have at most as many pixels."""

_FORMATS = ("PNG", "JPEG", "WEBP")  # Pillow's other decoders are less tested; EPS runs a program
_DAMAGE = (
    OSError,
    ValueError,
    SyntaxError,
    EOFError,
    IndexError,
    KeyError,
    TypeError,
    OverflowError,
    struct.error,
    zlib.error,
    Image.DecompressionBombError,
)
_QUIET = threading.Lock()
"""Held while the warnings of the library are off: the filter belongs to the whole process, and two
threads that restore it in turn may leave it as neither found it."""

Texels = NDArray[np.uint8]


class PictureSizeError(MeshError):
    """A picture is larger than what is left for it."""


def decoded(content: bytes, most: int, longest: int | None = None) -> tuple[Texels, int]:
    """Decode a picture to (h, w, 4) uint8 sRGB.

    Args:
        content: of the file.
        most: pixels that it may have.
        longest: side [px] that it is reduced to; None leaves it as it is.

    Returns:
        The picture, and how many pixels were decoded for it.

    Raises:
        PictureSizeError: it has more.
        MeshError: it has another format or is damaged.
    """
    try:
        with _QUIET, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the size is checked here, before a pixel is decoded
            with Image.open(io.BytesIO(content), formats=_FORMATS) as image:
                pixels = image.width * image.height
                if pixels > most:
                    raise PictureSizeError(f"{image.width} x {image.height} pixels are too many")
                if longest is not None:
                    image.thumbnail((longest, longest))
                return np.asarray(image.convert("RGBA"), dtype=np.uint8), pixels
    except PictureSizeError:
        raise
    except Image.DecompressionBombError as error:
        raise PictureSizeError("it has too many pixels") from error
    except _DAMAGE:
        raise MeshError("its image is damaged or not PNG, JPEG or WebP") from None
