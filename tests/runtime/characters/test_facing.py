"""Facing: a body that shows its back is turned about, one in profile is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.rest_heading import rest_heading
from runtime.characters.character import Character
from runtime.characters.facing import facing_the_audience
from runtime.characters.open_character import load_character
from tests.runtime.capsule_bodies import DOG, capsule_body
from tests.runtime.stick_figures import make_figure
from tests.thorough import third_of


def written(folder: Path, yaw: float) -> Path:
    """A file of a dog that faces so many degrees from +Z."""
    rotation = Rotation.from_euler("y", yaw, degrees=True).as_matrix()
    body = capsule_body(DOG).moved(rotation)
    path = folder / "dog.obj"
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in body.vertices]
    path.write_text("\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in body.faces + 1)]))
    return path


def heading(character: Character) -> float:
    assert character.plan is not None
    return float(np.degrees(rest_heading(character.skeleton, character.plan)))


@pytest.mark.parametrize(("yaw", "seen"), third_of([(180, 90), (0, 90), (90, 90), (-90, -90)]))
def test_a_dog_shows_its_face_or_its_side(tmp_path: Path, yaw: float, seen: float) -> None:
    character = load_character(written(tmp_path, yaw))
    assert heading(character) == pytest.approx(seen, abs=8.0)
    assert ("backwards" in " ".join(character.notes)) == (yaw == 180)
    at = character.skeleton.rest_positions
    low, high = character.vertices.min(axis=0), character.vertices.max(axis=0)
    assert ((at >= low - 0.05) & (at <= high + 0.05)).all()  # tips may stand out a little
    back = character.in_file_coordinates(character.vertices)
    stage = back @ character.file_to_stage[:3, :3].T + character.file_to_stage[:3, 3]
    np.testing.assert_allclose(stage, character.vertices[character.surface.vertex], atol=1e-9)


def test_a_character_without_a_plan_stays_as_it_is() -> None:
    figure = make_figure()
    assert facing_the_audience(figure) is figure
