"""Captions: the characters' names in small letters at their feet."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from runtime.render.programs import link, release_all

INK = (0.93, 0.80, 0.60, 0.78)  # encoded sRGB and opacity: old ivory
LONGEST = 40


class CaptionPainter:
    """Draws short texts below points of the picture; keeps a texture of each text."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._program = link(context, "caption", "caption")
        self._array = context.vertex_array(self._program, [])
        self._textures: dict[tuple[str, int], moderngl.Texture] = {}

    def draw(self, text: str, at: tuple[float, float], target: moderngl.Framebuffer) -> None:
        """Draw `text` just below the pixel `at` (from the lower left), centred on it."""
        width, height = target.size
        points = max(round(height * 0.026), 8)
        letters = self._letters(text[:LONGEST], points)
        left = round(at[0] - letters.width / 2)
        bottom = max(round(at[1] - letters.height), 2)
        box = np.array([left, bottom, left + letters.width, bottom + letters.height], dtype=float)
        clip = box / [width, height, width, height] * 2.0 - 1.0
        self._program["box"] = tuple(clip)
        self._program["ink"] = INK
        letters.use(0)
        self._array.render(moderngl.TRIANGLE_STRIP, vertices=4)

    def _letters(self, text: str, points: int) -> moderngl.Texture:
        key = (text, points)
        if key not in self._textures:
            pixels = _typeset(text, points)
            texture = self._context.texture(pixels.shape[::-1], 1, pixels.tobytes(), alignment=1)
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._textures[key] = texture
        return self._textures[key]

    def release(self) -> None:
        """Free its GL objects."""
        release_all(self._array, self._program, *self._textures.values())


def _typeset(text: str, points: int) -> NDArray[np.uint8]:
    """Return spaced letters (h, w), 255 where there is ink, in Pillow's font: alike everywhere."""
    font = ImageFont.load_default(points)
    spacing = points * 0.10
    shown = text or " "
    width = sum(font.getlength(letter) + spacing for letter in shown)
    picture = Image.new("L", (int(width) + 4, int(points * 1.5)), 0)
    pen = ImageDraw.Draw(picture)
    x = 2.0
    for letter in shown:
        pen.text((x, points * 0.1), letter, fill=255, font=font)
        x += font.getlength(letter) + spacing
    return np.asarray(picture)
