"""The scene: a stage with the puppets on it, the camera, and the inset of the performer."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.control.ramp import Ramp
from runtime.driving.driver import Highlight
from runtime.driving.performer import Pose
from runtime.puppet.puppet import Motion, Puppet
from runtime.render.background import Background
from runtime.render.camera import front_camera
from runtime.render.inset import SkeletonInset
from runtime.render.stage import Stage
from runtime.render.tubes import PAIR_COLOURS

if TYPE_CHECKING:
    import moderngl

GAP = 0.18  # [m] of floor between two characters
BLACKOUT = 0.3  # [s] to black, and back to light
ROOM = 0.12  # share of a character's size that stays in view around its rest pose


class Scene:
    """Puts characters side by side on one stage and draws their motion.

    Args:
        context: the OpenGL context of this thread.
        size: width and height of the picture [px].
        puppets: on the stage, from left to right.
        performer: the skeleton that the inset shows.
        background: replaces backdrop and floor; the picture is then plain and without captions.
        plain: draw neither the highlights nor the inset.
        clock: host monotonic time [s].

    Attributes:
        stage: draws the characters and the inset.
        camera: the view of the picture.
        highlights: whether the drivers' highlights are drawn.
        blackout: 0 for light, 1 for black.
    """

    def __init__(
        self,
        context: moderngl.Context,
        size: tuple[int, int],
        puppets: Sequence[Puppet],
        performer: Skeleton,
        *,
        background: Background | None = None,
        plain: bool = False,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.blackout = Ramp(BLACKOUT, clock)
        self.stage = Stage(context, size, background=background)
        self._puppets = puppets
        self._captions = len(puppets) > 1 and background is None
        places = _side_by_side([puppet.character for puppet in puppets])
        self._characters = [
            self.stage.add(
                puppet.character,
                position=(place, 0.0, 0.0),
                caption=puppet.character.name if self._captions else "",
            )
            for puppet, place in zip(puppets, places, strict=True)
        ]
        plain = plain or background is not None
        self._inset = None if plain else SkeletonInset(performer.parents)
        self.highlights = not plain
        self.camera = front_camera()
        self._filled: NDArray[np.float64] | None = None
        self.frame_all()

    def frame_all(self, filled: NDArray[np.float64] | None = None) -> None:
        """Move the camera so that every character is in view, with room to move.

        Args:
            filled: (A, 2, 3) [m] corners of all that each puppet fills in the show, in its own
                coordinates. If None, those given before; if none were, a guess by the rest poses.
        """
        boxes = self.stage.boxes
        self._filled = filled = self._filled if filled is None else filled
        if filled is None:
            room = ROOM * np.ptp(boxes, axis=1).max(axis=1)[:, None]
            boxes[:, 0, ::2] -= room
            boxes[:, 1] += room
        else:
            places = np.array([character.position for character in self._characters])[:, None]
            moved = filled + places
            boxes = np.stack(
                [np.minimum(boxes[:, 0], moved[:, 0]), np.maximum(boxes[:, 1], moved[:, 1])], axis=1
            )
        self.camera = self.camera.frame(boxes, self.stage.aspect)

    def show(self, pose: Pose | None, motions: Sequence[Motion]) -> None:
        """Draw the puppets as they are now, and the performer in the inset."""
        self.upload(motions)
        self.draw(pose)

    def upload(self, motions: Sequence[Motion]) -> None:
        """Upload the vertices of the puppets to the GPU."""
        for character, motion in zip(self._characters, motions, strict=True):
            character.update(motion.vertices)

    def draw(self, pose: Pose | None) -> None:
        """Draw the uploaded puppets with their highlights, and the performer in the inset."""
        highlights = [puppet.highlights for puppet in self._puppets]
        for character, own in zip(self._characters, highlights, strict=True):
            lit = own if self.highlights else []
            character.highlight([each.points for each in lit], _colours(len(lit)))
        if self._inset is not None and pose is not None:
            colours = _joint_colours(len(pose.seen), highlights[0])
            self._inset.update(pose.seen, colours=colours, dimmed=pose.filled)
        self.stage.brightness = 1.0 - self.blackout.level
        self.stage.draw(self.camera, self._inset if pose is not None else None)

    def picture(self) -> NDArray[np.uint8]:
        """Return the newest picture (H, W, 4): sRGB with straight alpha, top row first."""
        return self.stage.read()

    def close(self) -> None:
        """Free the stage."""
        self.stage.release()


def _side_by_side(characters: Sequence[Character]) -> list[float]:
    """Return the x coordinate [m] of each character in a row that is centred."""
    places, right = [], 0.0
    for character in characters:
        low, high = character.vertices[:, 0].min(), character.vertices[:, 0].max()
        places.append(right - float(low))
        right += float(high - low) + GAP
    middle = (right - GAP) / 2.0
    if len(characters) == 1:
        return [0.0]
    return [place - middle for place in places]


def _colours(count: int) -> NDArray[np.float64]:
    """Linear RGB (C, 3) of `count` highlights, in order."""
    return PAIR_COLOURS[np.arange(count) % len(PAIR_COLOURS)]


def _joint_colours(joints: int, highlights: Sequence[Highlight]) -> NDArray[np.float64]:
    """Linear RGB of each joint (J, 3): the colour of its highlight; NaN where it has none."""
    colours = np.full((joints, 3), np.nan)
    for highlight, colour in zip(highlights, _colours(len(highlights)), strict=True):
        colours[list(highlight.joints)] = colour
    return colours
