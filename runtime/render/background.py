"""What is behind the actors: the house, a plain colour to be keyed out, or nothing."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Background:
    """A plain background instead of the house: no floor, no shadow, no light falls on it.

    Attributes:
        red, green, blue: sRGB bytes.
        alpha: 255, or 0 for a background that is not there.
    """

    red: int
    green: int
    blue: int
    alpha: int = 255

    @property
    def premultiplied(self) -> tuple[float, float, float, float]:
        """Encoded red, green, blue and alpha in [0, 1], as targets hold them."""
        share = self.alpha / 255.0
        red, green, blue = (
            channel / 255.0 * share for channel in (self.red, self.green, self.blue)
        )
        return red, green, blue, share


NOTHING = Background(0, 0, 0, 0)
"""What is laid over something else: only the actors are opaque."""
