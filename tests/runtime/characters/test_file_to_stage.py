"""Placement: characters stand upright on the floor, facing the front."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from runtime.characters.builtin import builtin_character
from runtime.characters.file_to_stage import (
    ABOUT_FACE,
    HEIGHT,
    UPRIGHT,
    WIDTH,
    Z_UP,
    file_to_stage_matrix,
    guess_rotation,
    placed,
)
from runtime.characters.formats.mesh_file import read_mesh_file
from tests.thorough import examples

QUARTER = Rotation.from_euler("y", 90, degrees=True).as_matrix()


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    mesh = read_mesh_file(path)
    return mesh.vertices, mesh.faces


@given(st.integers(0, 2**32 - 1), st.floats(-8, 8))
@settings(max_examples=examples(60), deadline=None)
def test_a_placement_stands_in_the_middle_and_can_be_undone(seed: int, exponent: float) -> None:
    random = np.random.default_rng(seed)
    points = (random.normal(size=(30, 3)) * random.uniform(0.01, 1, 3) + 5.0) * 10.0**exponent
    rotation = Rotation.random(random_state=seed).as_matrix()
    matrix = file_to_stage_matrix(rotation, points)
    on_stage = placed(matrix, points)
    low, high = on_stage.min(axis=0), on_stage.max(axis=0)
    np.testing.assert_allclose((low + high)[[0, 2]], 0.0, atol=1e-9)
    np.testing.assert_allclose(low[1], 0.0, atol=1e-9)
    shares = (high - low) / [WIDTH, HEIGHT, WIDTH]
    np.testing.assert_allclose(shares.max(), 1.0)
    scale = np.cbrt(np.linalg.det(matrix[:3, :3]))
    np.testing.assert_allclose(matrix[:3, :3] / scale, rotation, atol=1e-12)
    back = placed(np.linalg.inv(matrix), on_stage)
    np.testing.assert_allclose(back, points, rtol=1e-9, atol=1e-9 * np.abs(points).max())


def test_constants_are_rotations_that_turn_as_they_say() -> None:
    for rotation in (Z_UP, ABOUT_FACE, UPRIGHT):
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3))
        assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(Z_UP @ [0, 0, 1], [0, 1, 0])
    np.testing.assert_allclose(Z_UP @ [0, -1, 0], [0, 0, 1])


@pytest.mark.parametrize("name", ["squid", "cactus", "trex", "paper", "mannequin"])
@pytest.mark.parametrize("turn", [np.eye(3), QUARTER], ids=["front", "side"])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_up_axis_of_known_characters_is_found(
    name: str, turn: np.ndarray, scale: float
) -> None:
    character = builtin_character(name)
    upright = scale * character.vertices @ turn.T + scale
    rotation, _ = guess_rotation(upright, character.faces)
    np.testing.assert_array_equal(rotation[1], [0, 1, 0])
    rotation, notes = guess_rotation(upright @ Z_UP, character.faces)
    np.testing.assert_array_equal(rotation[1], [0, 0, 1])
    assert "+Z" in notes[0]


def test_a_back_is_turned_from_the_audience() -> None:
    character = builtin_character("mannequin")
    rotation, notes = guess_rotation(character.vertices, character.faces)
    np.testing.assert_array_equal(rotation, UPRIGHT)
    assert len(notes) == 1
    rotation, notes = guess_rotation(character.vertices @ ABOUT_FACE.T, character.faces)
    np.testing.assert_array_equal(rotation, ABOUT_FACE)
    assert "feet" in notes[1]
    rotation, _ = guess_rotation(character.vertices @ ABOUT_FACE.T @ Z_UP, character.faces)
    np.testing.assert_array_equal(rotation, ABOUT_FACE @ Z_UP)


@pytest.mark.parametrize("thin", range(3))
def test_a_sheet_shows_its_face_upright(thin: int) -> None:
    square = np.array([[0.0, 0], [3, 0], [3, 1], [0, 1]])
    vertices = np.insert(square, thin, 2.0, axis=1)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    rotation, notes = guess_rotation(vertices, faces)
    on_stage = placed(file_to_stage_matrix(rotation, vertices), vertices)
    np.testing.assert_allclose(np.ptp(on_stage, axis=0)[2], 0.0, atol=1e-12)
    assert "flat" in notes[0]
    if thin == 2:  # drawn in xy: as it was drawn
        np.testing.assert_array_equal(rotation, UPRIGHT)


def test_a_line_of_a_surface_can_be_placed() -> None:
    vertices, faces = np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]), np.array([[0, 1, 2]])
    rotation, _ = guess_rotation(vertices, faces)
    assert np.isfinite(file_to_stage_matrix(rotation, vertices)).all()


REAL_Z_UP = ["mesh/cgal_man.off", "mesh/cgal_dino.off", "human/anny_thin_male_rest.obj"]
REAL_Y_UP = [
    "mesh/cow.off",
    "mesh/camel_b.obj",
    "mesh/decimated-knight.off",
    "mesh/teddy.obj",
    "mesh/elephant.obj",
    "mesh/cat_dt/dog_reference.obj",
    "mesh/bad/beetle.off",
    "mesh/arm.obj",
    "mesh/octopus-low.mesh",
    "mesh/woody_planar.obj",
]


@pytest.mark.parametrize("name", REAL_Z_UP)
def test_real_figures_along_z_stand_and_face_the_front(shared: Path, name: str) -> None:
    rotation, _ = guess_rotation(*read(shared / name))
    np.testing.assert_array_equal(rotation, Z_UP)


@pytest.mark.parametrize("name", REAL_Y_UP)
def test_real_figures_along_y_stay_as_they_are(shared: Path, name: str) -> None:
    rotation, _ = guess_rotation(*read(shared / name))
    np.testing.assert_array_equal(rotation, UPRIGHT)


def test_a_real_figure_that_shows_its_back_is_turned(shared: Path) -> None:
    rotation, _ = guess_rotation(*read(shared / "mesh/cgal_armadillo.off"))
    np.testing.assert_array_equal(rotation, ABOUT_FACE)
