"""Turn a character that shows the audience its back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devices.bodies.rest_heading import rest_heading
from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.characters.file_to_stage import ABOUT_FACE

BACK = np.radians(120.0)
"""A greater heading shows the back; one that is smaller may show a side on purpose."""


def turned(character: Character, rotation: NDArray[np.float64], note: str) -> Character:
    """Return the character turned about the vertical through the middle of the stage."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    body = character.body
    return replace(
        character,
        vertices=character.vertices @ rotation.T,
        skeleton=_turned(character.skeleton, rotation),
        file_to_stage=matrix @ character.file_to_stage,
        notes=(*character.notes, note),
        morphs=None if character.morphs is None else character.morphs.turned(rotation),
        body=None if body is None else replace(body, skeleton=_turned(body.skeleton, rotation)),
    )


def _turned(skeleton: Skeleton, rotation: NDArray[np.float64]) -> Skeleton:
    return Skeleton(skeleton.names, skeleton.parents, skeleton.rest_positions @ rotation.T)


def facing_the_audience(character: Character) -> Character:
    """Return the character, turned about if the plan of its body shows that it faces away."""
    if character.plan is None:
        return character
    if abs(rest_heading(character.skeleton, character.plan)) <= BACK:
        return character
    return turned(character, ABOUT_FACE, "its body faces backwards: turned about to the front")
