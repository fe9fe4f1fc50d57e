"""Turn a long character, such as a camel, so that the camera sees its side.

From the front a camel hides most of itself, and matching on the screen has few bones to compare.
The better view is the one in which the bones are longer (AniMesh, section 8, "preferable
viewpoint"). A character that is much longer than wide, with longer bones from the side, is turned
by a quarter to its left. One without limbs, such as a snake, sways: this is seen from the front.
"""

from __future__ import annotations

import numpy as np

from runtime.characters.character import Character
from runtime.characters.facing import turned

LONG = 2.0  # least ratio of length to width
MORE = 1.2  # least ratio of the bones' lengths from the side to those from the front

_TO_THE_LEFT = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def turned_to_best_side(character: Character) -> Character:
    """Return the character, turned by a quarter if it is long and its side shows more bones."""
    plan = character.plan
    if plan is not None and not plan.arms and not plan.legs:
        return character
    width, _, length = np.ptp(character.vertices, axis=0)
    if length < LONG * width or _bones_seen(character, 2) < MORE * _bones_seen(character, 0):
        return character
    return turned(character, _TO_THE_LEFT, "shows more from the side: turned to its left")


def _bones_seen(character: Character, across: int) -> float:
    """The sum of the bones' lengths [m], projected on the plane of y and the axis `across`."""
    parents = character.skeleton.parents
    child = np.flatnonzero(parents >= 0)
    positions = character.skeleton.rest_positions
    bones = positions[child] - positions[parents[child]]
    return float(np.linalg.norm(bones[:, [across, 1]], axis=1).sum())
