"""Draw deformed characters side by side on a stage, with captions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from runtime.characters.character import Character
from runtime.render.camera import front_camera
from runtime.render.context import headless_context, release_headless
from runtime.render.stage import Stage
from solvers.linear.laplacian import Floats, Ints

_GAP = 0.16  # [m] between two characters of a row
_HANDLE_COLOUR = (0.05, 0.5, 0.12, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Exhibit:
    """A character with deformed vertices (N, 3) [m] and a caption.

    Its `handles` (H,) are painted green, as in the paper's figures.
    """

    character: Character
    vertices: Floats
    handles: Ints
    caption: str

    def as_character(self) -> Character:
        """Return the character with this pose as its rest pose."""
        surface = self.character.surface
        colours = surface.colors.copy()
        colours[np.isin(surface.vertex, self.handles)] = _HANDLE_COLOUR
        return replace(
            self.character, vertices=self.vertices, surface=replace(surface, colors=colours)
        )


class Gallery:
    """Draws rows of exhibits without a window; a context manager.

    Raises:
        InputError: there is no OpenGL without a window.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._context = headless_context()

    def __enter__(self) -> Gallery:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        release_headless(self._context)

    def row(self, exhibits: Sequence[Exhibit]) -> NDArray[np.uint8]:
        """Draw exhibits in a row, on one floor and at one scale, into a picture (H, W, 4)."""
        stage = Stage(self._context, self._size)
        try:
            right = 0.0
            for exhibit in exhibits:
                low, high = exhibit.vertices[:, 0].min(), exhibit.vertices[:, 0].max()
                place = (right - float(low), 0.0, 0.0)
                stage.add(exhibit.as_character(), position=place, caption=exhibit.caption)
                right += float(high - low) + _GAP
            stage.draw(front_camera().frame(stage.boxes, stage.aspect, margin=0.06))
            return stage.read()
        finally:
            stage.release()
