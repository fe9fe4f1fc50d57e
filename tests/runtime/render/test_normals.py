"""Normals of deforming surfaces: smooth over seams, sharp at creases, never NaN."""

from __future__ import annotations

import math

import numpy as np
import trimesh

from runtime.characters.character import Character, Surface
from runtime.render.normals import (
    CREASE,
    DeformingNormals,
    bounding_box,
    is_closed,
    split_vertices,
)
from tests.runtime.render.shapes import shape_of


def drawn(character: Character, crease: float = CREASE) -> tuple[np.ndarray, np.ndarray]:
    """Positions (D, 3) and normals (D, 3) as they go to the GPU."""
    split = split_vertices(character, crease=crease)
    out = DeformingNormals(split).fill(character.vertices)
    return out[:, :3], out[:, 3:]


def test_a_sphere_is_smooth_and_its_normals_point_outward() -> None:
    sphere = shape_of(trimesh.creation.icosphere(subdivisions=3))
    positions, normals = drawn(sphere)
    assert len(positions) == len(sphere.vertices)
    assert (positions * normals).sum(axis=1).min() > 0.9995


def test_a_box_is_sharp_and_each_corner_is_drawn_for_three_sides() -> None:
    _, normals = drawn(shape_of(trimesh.creation.box()))
    assert len(normals) == 24
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1.0, atol=1e-6)


def test_normals_do_not_depend_on_which_diagonal_cuts_a_side() -> None:
    # Three right angles meet at a box's corner, cut by one to two triangles a side.
    positions, normals = drawn(shape_of(trimesh.creation.box()), crease=math.pi)
    assert len(positions) == 8
    np.testing.assert_allclose(normals, positions * 2.0 / math.sqrt(3.0), atol=1e-6)


def test_a_seam_of_the_file_does_not_show_in_the_normals() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    whole = shape_of(sphere)
    surface = whole.surface
    torn = Surface(  # every face has vertices of its own in the file
        vertex=surface.faces.reshape(-1).astype(np.int64),
        faces=np.arange(3 * len(surface.faces), dtype=np.int32).reshape(-1, 3),
        colors=np.ones((3 * len(surface.faces), 4), dtype=np.float32),
        uvs=None,
        materials=surface.materials,
        face_material=surface.face_material,
    )
    split = Character("torn", whole.vertices, whole.faces, whole.skeleton, None, torn, np.eye(4))
    positions, normals = drawn(split)
    assert len(positions) == 3 * len(surface.faces)
    assert (positions * normals).sum(axis=1).min() > 0.999


def test_faces_that_disagree_about_outside_do_not_cancel() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 3, 2]])  # the second runs the other way round
    _, normals = drawn(shape_of(trimesh.Trimesh(vertices, faces, process=False)))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)


def test_a_face_without_area_gives_no_nan() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 1, 3]])
    _, normals = drawn(shape_of(trimesh.Trimesh(vertices, faces, process=False)))
    assert np.isfinite(normals).all()


def angle_weighted(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (N, 3) by the definition: face normals, weighted by the angle at the vertex."""
    sums = np.zeros_like(vertices)
    for face in faces:
        corners = vertices[face]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        for k in range(3):
            to_next, to_last = corners[k - 2] - corners[k], corners[k - 1] - corners[k]
            cross = np.linalg.norm(np.cross(to_next, to_last))
            if cross > 0.0:
                sums[face[k]] += normal / cross * math.atan2(cross, to_next @ to_last)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.asarray(np.divide(sums, length, out=np.zeros_like(sums), where=length > 0.0))


def test_every_normal_is_what_the_definition_says_on_slivers_and_folds_too() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3)  # 1280 faces: many blocks, and a part
    faces = np.asarray(sphere.faces)[:-1]
    whole = shape_of(trimesh.Trimesh(sphere.vertices, faces, process=False))
    normals = DeformingNormals(split_vertices(whole, crease=math.pi))
    round_, chance = np.asarray(sphere.vertices), np.random.default_rng(5)
    rough = round_ + chance.normal(scale=0.08, size=round_.shape)  # edges are 0.14 long: it folds
    squashed = round_ * (1.0, 1e-4, 1.0) + chance.normal(scale=1e-5, size=round_.shape)
    torn = rough.copy()
    torn[faces[100]] = torn[faces[100, 0]]  # no area, in the middle of a block
    for shape in (rough, squashed, torn, round_):
        filled = normals.fill(shape)
        np.testing.assert_array_equal(filled[:, :3], shape.astype(np.float32))
        # Angles are good to 2e-8; where the surface is folded flat, what is left of a sum is small.
        np.testing.assert_allclose(filled[:, 3:], angle_weighted(shape, faces), atol=1e-5)


def test_where_all_faces_are_without_area_the_normal_is_zero() -> None:
    sphere = shape_of(trimesh.creation.icosphere(subdivisions=1))
    normals = DeformingNormals(split_vertices(sphere))
    normals.fill(sphere.vertices)
    assert not normals.fill(np.ones_like(sphere.vertices))[:, 3:].any()


def test_two_runs_agree_to_the_last_bit() -> None:
    torus = shape_of(trimesh.creation.torus(1.0, 0.3))
    assert drawn(torus)[1].tobytes() == drawn(torus)[1].tobytes()


def test_only_watertight_shapes_hide_their_inside() -> None:
    box = trimesh.creation.box()
    faces = np.asarray(box.faces, dtype=np.int32)
    assert is_closed(np.asarray(box.vertices), faces)
    assert not is_closed(np.asarray(box.vertices), faces[1:])  # one triangle is missing


def test_a_shape_turned_inside_out_is_drawn_from_both_sides() -> None:
    box = trimesh.creation.box()
    faces = np.asarray(box.faces, dtype=np.int32)[:, ::-1]
    assert not is_closed(np.asarray(box.vertices), faces)


def test_the_bounding_box_is_that_of_all_points() -> None:
    points = np.random.default_rng(3).normal(size=(50, 3))
    np.testing.assert_array_equal(bounding_box(points), [points.min(axis=0), points.max(axis=0)])
