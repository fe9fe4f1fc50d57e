"""The picture behind the characters: floor and curtain, a plain colour for keying, or nothing."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Background:
    """A plain colour instead of floor and curtain, without shadows or reflections.

    Attributes:
        red, green, blue: sRGB bytes.
        alpha: 255 for opaque, 0 for a transparent picture.
    """

    red: int
    green: int
    blue: int
    alpha: int = 255

    @property
    def premultiplied(self) -> tuple[float, float, float, float]:
        """Red, green and blue in sRGB times alpha, and alpha, all in [0, 1]."""
        share = self.alpha / 255.0
        red, green, blue = (
            channel / 255.0 * share for channel in (self.red, self.green, self.blue)
        )
        return red, green, blue, share


NOTHING = Background(0, 0, 0, 0)
"""A transparent background: only the characters are opaque."""
