"""Surfaces side by side on the stage, each with its name at its feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from runtime.character import Character, Material, Surface
from runtime.render.camera import front_camera
from runtime.render.stage import Stage
from solvers.laplacian import Floats, Ints

if TYPE_CHECKING:
    import moderngl

_GAP = 0.22  # metres between two of a row
_HANDLE_COLOUR = (0.05, 0.5, 0.12, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Exhibit:
    """A surface as it is shown: vertices (N, 3) [m], faces (F, 3), a name, and linear RGBA.

    `handles` (H,) are painted green, as in the paper's figures.
    """

    vertices: Floats
    faces: Ints
    caption: str
    colour: NDArray[np.float32]
    handles: Ints


def row_picture(
    context: moderngl.Context, exhibits: Sequence[Exhibit], size: tuple[int, int]
) -> NDArray[np.uint8]:
    """A picture (H, W, 4) of exhibits in a row, on one floor and at one scale."""
    stage = Stage(context, size)
    try:
        right = 0.0
        for exhibit in exhibits:
            low, high = exhibit.vertices[:, 0].min(), exhibit.vertices[:, 0].max()
            place = (right - float(low), 0.0, 0.0)
            stage.add(_as_character(exhibit), position=place, caption=exhibit.caption)
            right += float(high - low) + _GAP
        camera = front_camera().frame(stage.boxes, stage.aspect, margin=0.08)
        stage.draw(camera)
        return stage.read()
    finally:
        stage.release()


def _as_character(exhibit: Exhibit) -> Character:
    count = len(exhibit.vertices)
    colours = np.tile(exhibit.colour, (count, 1)).astype(np.float32)
    colours[exhibit.handles] = _HANDLE_COLOUR
    return Character(
        name=exhibit.caption,
        vertices=exhibit.vertices,
        faces=exhibit.faces,
        skeleton=Skeleton(("root",), np.array([-1]), np.zeros((1, 3))),
        weights=None,
        surface=Surface(
            vertex=np.arange(count),
            faces=exhibit.faces.astype(np.int32),
            colors=colours,
            uvs=None,
            materials=(Material(np.ones(4, dtype=np.float32)),),
            face_material=np.zeros(len(exhibit.faces), dtype=np.int64),
        ),
        placement=np.eye(4),
    )
