"""Alpha and size conversions of a finished picture for files, cameras and other programs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Picture = NDArray[np.uint8]


def premultiplied(picture: Picture) -> Picture:
    """Multiply the colours of a picture (H, W, 4) by its alpha; the alpha stays."""
    alpha = picture[..., 3:]
    if (alpha == 255).all():
        return picture
    product = picture.copy()
    product[..., :3] = (picture[..., :3].astype(np.uint16) * alpha + 127) // 255
    return product


def on_black(picture: Picture) -> Picture:
    """Return the colours (H, W, 3) of a picture (H, W, 4) composed over black."""
    return np.ascontiguousarray(premultiplied(picture)[..., :3])


def fitted(picture: Picture, size: tuple[int, int]) -> Picture:
    """Scale a picture (H, W, 4) to fit into `size`, width and height [px], and centre it.

    The bars beside it take the colour of the picture's upper left corner: transparent, or the plain
    background.
    """
    height, width = picture.shape[:2]
    if (width, height) == size:
        return picture
    share = min(size[0] / width, size[1] / height)
    within = max(round(share * width), 1), max(round(share * height), 1)
    canvas = Image.new("RGBA", size, tuple(int(channel) for channel in picture[0, 0]))
    scaled = Image.fromarray(picture).resize(within, Image.Resampling.BILINEAR)
    canvas.paste(scaled, ((size[0] - within[0]) // 2, (size[1] - within[1]) // 2))
    return np.array(canvas)
