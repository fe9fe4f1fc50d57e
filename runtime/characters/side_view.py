"""Turn a long character, such as a camel, so that the camera sees its side.

From the front a camel hides most of itself, and matching on the screen has few bones to compare.
The better view is the one in which the bones are longer (AniMesh, section 8, "preferable
viewpoint"). A character that is much longer than wide, with longer bones from the side, is turned
by a quarter to its left.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from devices.skeleton import Skeleton
from runtime.characters.character import Character

LONG = 2.0  # least ratio of length to width
MORE = 1.2  # least ratio of the bones' lengths from the side to those from the front

_TO_THE_LEFT = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def turned_to_best_side(character: Character) -> Character:
    """Return the character, turned by a quarter if it is long and its side shows more bones."""
    width, _, length = np.ptp(character.vertices, axis=0)
    if length < LONG * width or _bones_seen(character, 2) < MORE * _bones_seen(character, 0):
        return character
    skeleton = character.skeleton
    to_the_left = np.eye(4)
    to_the_left[:3, :3] = _TO_THE_LEFT
    return replace(
        character,
        vertices=character.vertices @ _TO_THE_LEFT.T,
        skeleton=Skeleton(
            skeleton.names, skeleton.parents, skeleton.rest_positions @ _TO_THE_LEFT.T
        ),
        file_to_stage=to_the_left @ character.file_to_stage,
        notes=(*character.notes, "shows more from the side: turned to its left"),
    )


def _bones_seen(character: Character, across: int) -> float:
    """The sum of the bones' lengths [m], projected on the plane of y and the axis `across`."""
    parents = character.skeleton.parents
    child = np.flatnonzero(parents >= 0)
    positions = character.skeleton.rest_positions
    bones = positions[child] - positions[parents[child]]
    return float(np.linalg.norm(bones[:, [across, 1]], axis=1).sum())
