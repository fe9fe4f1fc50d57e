"""Which side a character shows to the house.

A camel seen from the front hides most of itself, and matching on the screen has little to go by. Of
the side and the front the better view is the one that shows more of the bones' lengths (proposed as
a preferable viewpoint in AniMesh, section 8); a character that is much longer than wide, and shows
more from the side, is turned to its left.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from devices.skeleton import Skeleton
from runtime.characters.character import Character

LONG = 2.0  # times as long as wide
MORE = 1.2  # times the length of bones seen from the front

_TO_THE_LEFT = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def seen_from_best_side(character: Character) -> Character:
    """The character, turned by a quarter where its side shows much more than its front."""
    width, _, length = np.ptp(character.vertices, axis=0)
    if length < LONG * width or _bones_seen(character, 2) < MORE * _bones_seen(character, 0):
        return character
    skeleton = character.skeleton
    placement = np.eye(4)
    placement[:3, :3] = _TO_THE_LEFT
    return replace(
        character,
        vertices=character.vertices @ _TO_THE_LEFT.T,
        skeleton=Skeleton(
            skeleton.names, skeleton.parents, skeleton.rest_positions @ _TO_THE_LEFT.T
        ),
        placement=placement @ character.placement,
        notes=(*character.notes, "shows more from the side: turned to its left"),
    )


def _bones_seen(character: Character, across: int) -> float:
    """Sum of the bones' lengths [m] in a picture of the plane of y and the axis `across`."""
    parents = character.skeleton.parents
    child = np.flatnonzero(parents >= 0)
    positions = character.skeleton.rest_positions
    bones = positions[child] - positions[parents[child]]
    return float(np.linalg.norm(bones[:, [across, 1]], axis=1).sum())
