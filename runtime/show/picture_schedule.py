"""Decides when the scene is drawn, and when a picture of it is read back for the outputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.output.output import Output, Screen
from runtime.show.scene import Scene

EARLY = 0.75  # of the wanted step between pictures; frames never come quite evenly

Picture = NDArray[np.uint8]


class PictureSchedule:
    """Draws every tick for a window, and as often as the outputs ask for pictures without one.

    Args:
        scene: draws; None where nothing is drawn.
        outputs: all outputs of the show.
        shown: whether a window shows every tick.
        clock: host monotonic time [s].
    """

    def __init__(
        self,
        scene: Scene | None,
        outputs: Sequence[Output],
        *,
        shown: bool,
        clock: Callable[[], float],
    ) -> None:
        self._scene = scene
        self._shown = shown
        self._clock = clock
        rate = max((output.pictures_a_second for output in outputs), default=0.0)
        self._step = EARLY / rate if rate > 0.0 else math.inf  # [s]
        self._screens = [output for output in outputs if isinstance(output, Screen)]
        self._taken = self._taken_at = -math.inf  # the last picture, by the show's time and ours

    def perform(self, time: float, draw: Callable[[], None]) -> Picture | None:
        """Draw a frame if it is seen.

        Args:
            time: [s] of the frame.
            draw: draws it.

        Returns:
            (H, W, 4) uint8 its picture, if an output wants one of this frame.
        """
        wanted = self.is_due(time)
        if self._scene is None or not (self._shown or wanted):
            return None
        if wanted:
            return self._read(self._scene, draw)
        draw()
        return None

    def is_due(self, time: float) -> bool:
        """Return whether outputs want a picture at `time` [s]; the next is due one step later."""
        due = math.isfinite(self._step) and time - self._taken >= self._step
        if due:
            self._taken = time
        return due

    def snapshot(self) -> float:
        """Return the show's time [s] of the last picture."""
        return self._taken

    def restore(self, taken: float) -> None:
        """Go back to a snapshot."""
        self._taken = taken

    def idle(self, draw: Callable[[], None]) -> None:
        """Draw although no frame has come: the camera and the light may change.

        Screens get a picture as often as they ask for.
        """
        if self._scene is None:
            return
        due = bool(self._screens) and self._clock() - self._taken_at >= self._step
        if not (self._shown or due):
            return
        if not due:
            draw()
            return
        picture = self._read(self._scene, draw)
        for screen in self._screens:
            screen.show(picture)

    def _read(self, scene: Scene, draw: Callable[[], None]) -> Picture:
        """Draw what outputs see: nothing of what is for the operator alone.

        Then draw again for the window.
        """
        with scene.for_outputs():
            draw()
            picture = scene.picture()
        self._taken_at = self._clock()
        if scene.is_for_operator:
            scene.redraw()
        return picture
