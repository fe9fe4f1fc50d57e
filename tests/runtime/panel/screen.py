"""A panel over a grey picture, and a mouse."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from runtime.panel.panel import Panel
from runtime.status.show_status import ShowStatus
from tests.runtime.staged import StagedShow

SIZE = (1280, 720)


class Screen:
    """A panel over a grey picture, and a mouse."""

    def __init__(
        self, context: moderngl.Context, show: StagedShow, size: tuple[int, int] = SIZE
    ) -> None:
        self.now = 0.0
        self.target = context.simple_framebuffer(size, components=4)
        self.status = show._opened.status
        self.panel = Panel(context, show.controls, self._newest, clock=lambda: self.now)

    def _newest(self) -> ShowStatus:
        return self.status()

    def draw(self, frames: int = 2) -> NDArray[np.uint8]:
        """Draw so many pictures a fifth of a second apart; the last, upper row first."""
        for _ in range(frames):
            self.now += 0.2
            self.target.clear(0.5, 0.5, 0.5, 1.0)
            self.panel.draw(self.target)
        width, height = self.target.size
        read = np.frombuffer(self.target.read(components=3, alignment=1), np.uint8)
        return read.reshape(height, width, 3)[::-1]

    def click(self, x: float, y: float) -> bool:
        """Click with the left button; whether the panel kept the click for itself."""
        gui = self.panel.gui
        gui.cursor(x, y)
        self.draw(1)
        kept = gui.button(0, down=True)
        self.draw(1)
        gui.button(0, down=False)
        self.draw(1)
        return kept


def covered(picture: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """The pixels that the panel covers or tints."""
    return np.abs(picture.astype(int) - 128).max(axis=2) > 2
