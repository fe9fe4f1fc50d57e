"""Where the hands of people are in a picture, and where they go in the hand model's small picture.

The hand model's detector sees a picture at 192 pixels: the hands of a person who is seen from head
to foot are a few pixels wide there. So it gets a mosaic of tiles, one around each wrist that the
body's model has found. A tile also says whose hand it shows, and which. Since tiles follow the
wrists, hands stay about where they are in the mosaic, and the model tracks them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.mediapipe.joints import HAND_LANDMARKS, POSE_LANDMARKS, SIDES

Array = NDArray[np.float64]

TILE = 192  # [pixels] of the mosaic
WIDTH = 0.42  # [m] that a tile shows: a hand is at most 0.2 m long
FEWEST_PIXELS = 24.0  # of the picture, in which no hand can be made out any more
VISIBLE = 0.3  # a wrist that is seen less than this has no tile
FARTHEST = 0.12  # [m] of a hand's wrist from where the body's model has it
_KNUCKLES = ("index", "pinky")


@dataclass(frozen=True, slots=True)
class Tile:
    """The place of one hand in a picture.

    Attributes:
        slot: its number in the mosaic: twice the person's row, and 1 more for the right hand.
        centre: (2,) [pixels of the picture].
        width: [pixels of the picture].
        wrist: (2,) [pixels of the mosaic] from the tile's corner.
    """

    slot: int
    centre: Array
    width: float
    wrist: Array


def pixels_per_metre(world: Array, picture: Array, weights: Array) -> float:
    """The scale that best takes a body's shape to its picture, seen from far away.

    Args:
        world: (N, 2) [m] points, x to the right of the picture, y down.
        picture: (N, 2) [pixels] the same points.
        weights: (N,) of each point.
    """
    total = float(weights.sum())
    if total <= 0.0:
        return 0.0
    shape, image = (one - weights @ one / total for one in (world, picture))
    size = float((weights[:, None] * shape**2).sum())
    return max(float((weights[:, None] * shape * image).sum()) / size, 0.0) if size > 0.0 else 0.0


def hand_tiles(world: Array, picture: Array, size: tuple[int, int], row: int) -> list[Tile]:
    """The tiles of one person's hands that the picture shows.

    Args:
        world: (33, 4) landmarks [m] and their visibility, as MediaPipe gives them.
        picture: (33, 2) landmarks [pixels].
        size: width and height of the picture [pixels].
        row: the person's place among all.
    """
    width = WIDTH * pixels_per_metre(world[:, :2], picture, world[:, 3])
    if width < FEWEST_PIXELS:
        return []
    tiles = []
    for number, side in enumerate(SIDES):
        wrist = POSE_LANDMARKS.index(f"{side}_wrist")
        knuckles = [POSE_LANDMARKS.index(f"{side}_{finger}") for finger in _KNUCKLES]
        centre = picture[knuckles].mean(axis=0)
        inside = ((centre > 0.0) & (centre < size)).all()
        if inside and world[wrist, 3] >= VISIBLE:
            at = (picture[wrist] - centre) * (TILE / width) + 0.5 * TILE
            tiles.append(Tile(2 * row + number, centre, width, at))
    return tiles


def mosaic_size(people: int) -> tuple[int, int]:
    """Width and height [pixels] of the mosaic for at most so many people."""
    return 2 * TILE, people * TILE


def corner(slot: int) -> tuple[int, int]:
    """The upper left corner of a slot [pixels of the mosaic]."""
    return slot % 2 * TILE, slot // 2 * TILE


def picture_to_tile(tile: Tile) -> Array:
    """(2, 3) takes pixels of the picture to pixels of the tile."""
    scale = TILE / tile.width
    shift = 0.5 * TILE - scale * tile.centre
    return np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])


def hands_of_tiles(tiles: Sequence[Tile], wrists: Array) -> Mapping[int, int]:
    """Which found hand each slot shows: the one whose wrist is nearest to the body's.

    Args:
        tiles: of the mosaic.
        wrists: (N, 2) [pixels of the mosaic] wrist of each hand that was found there.
    """
    shown: dict[int, int] = {}
    for tile in tiles if len(wrists) else ():
        steps = np.linalg.norm(wrists - (tile.wrist + corner(tile.slot)), axis=1)
        nearest = int(np.argmin(steps))
        if steps[nearest] < FARTHEST * TILE / WIDTH:
            shown[tile.slot] = nearest
    return shown


WRIST = HAND_LANDMARKS.index("wrist")
