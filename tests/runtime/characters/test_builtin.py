"""The built-in characters: sound meshes, skeletons that lie inside them, honest errors."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from devices.errors import InputError
from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.builtin.meshing import meshed, smallest_angles, split
from runtime.characters.builtin.sculpture import Limb, Paint, Sculpture, grow, painted
from runtime.characters.builtin.signed_distance import (
    curve,
    ellipsoid,
    in_front,
    lathe,
    smooth_difference,
    smooth_union,
    taper,
    tube,
)
from runtime.characters.character import Character

LIMBS = {
    "squid": {f"tentacle{number}." for number in range(1, 9)},
    "cactus": {"left", "right", "crown"},
    "trex": {"left_arm", "right_arm", "left_leg", "right_leg", "tail", "head"},
    "paper": {"left_arm", "right_arm", "left_leg", "right_leg", "top"},
    "mannequin": {"left_arm", "right_arm", "left_leg", "right_leg", "head"},
}


@pytest.fixture(scope="module", params=BUILTIN)
def character(request: pytest.FixtureRequest) -> Character:
    return builtin_character(request.param)


def as_trimesh(character: Character) -> trimesh.Trimesh:
    return trimesh.Trimesh(character.vertices, character.faces, process=False)


def test_the_surface_is_one_closed_sphere(character: Character) -> None:
    mesh = as_trimesh(character)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0.0
    assert mesh.body_count == 1
    assert mesh.euler_number == 2
    assert np.array_equal(np.unique(character.faces), np.arange(len(character.vertices)))


def test_the_mesh_is_of_a_size_to_perform_with(character: Character) -> None:
    assert 5_000 <= len(character.vertices) <= 15_000
    lower, upper = character.vertices.min(axis=0), character.vertices.max(axis=0)
    assert lower[1] == pytest.approx(0.0, abs=1e-6)
    assert 1.0 < upper[1] < 2.0
    assert abs(lower[0] + upper[0]) < 0.4


def test_the_triangles_are_even(character: Character) -> None:
    angles = np.degrees(smallest_angles(character.vertices, character.faces))
    assert angles.min() > 5.0
    assert np.percentile(angles, 1) > 19.0
    assert np.median(angles) > 43.0
    valence = np.bincount(character.faces.ravel())
    assert valence.min() >= 4
    assert valence.max() <= 9


def test_every_node_lies_inside(character: Character) -> None:
    inside = winding_numbers(character, character.skeleton.rest_positions)
    outside = [
        name for name, turns in zip(character.skeleton.names, inside, strict=True) if turns < 0.5
    ]
    assert outside == []


def winding_numbers(character: Character, points: np.ndarray) -> np.ndarray:
    """Source: Van Oosterom and Strackee 1983, solid angle of a triangle."""
    corners = character.vertices[character.faces]
    turns = []
    for point in points:
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        scale = la * lb * lc + (
            np.einsum("ij,ij->i", a, b) * lc
            + np.einsum("ij,ij->i", b, c) * la
            + np.einsum("ij,ij->i", c, a) * lb
        )
        turns.append(np.arctan2(volume, scale).sum() / (2.0 * np.pi))
    return np.array(turns)


def test_limbs_reach_the_ends_of_the_surface_in_even_bones(character: Character) -> None:
    skeleton = character.skeleton
    limbs = {name.rstrip("0123456789") for name in skeleton.names}
    assert LIMBS[character.name] <= limbs
    rest, parents = skeleton.rest_positions, skeleton.parents
    gaps = np.linalg.norm(character.vertices[:, None] - rest[None], axis=2)
    nearest = gaps.argmin(axis=1)
    for limb in LIMBS[character.name]:
        nodes = [i for i, name in enumerate(skeleton.names) if name.rstrip("0123456789") == limb]
        assert len(nodes) >= 3
        assert gaps[nearest == nodes[-1], nodes[-1]].max() < 0.27
        bones = np.linalg.norm(np.diff(rest[nodes], axis=0), axis=1)
        assert bones.max() < 1.8 * bones.min()
        assert np.count_nonzero(parents == nodes[-1]) == 0


def test_no_two_limbs_point_the_same_way_on_the_screen(character: Character) -> None:
    skeleton = character.skeleton
    middle = skeleton.rest_positions[skeleton.root]
    tips = []
    for limb in sorted(LIMBS[character.name]):
        nodes = [i for i, name in enumerate(skeleton.names) if name.rstrip("0123456789") == limb]
        tips.append((skeleton.rest_positions[nodes].mean(axis=0) - middle)[:2])
    directions = np.array(tips) / np.linalg.norm(tips, axis=1, keepdims=True)
    alike = directions @ directions.T - 2.0 * np.eye(len(tips))
    assert alike.max() < np.cos(np.radians(11.0))


def test_the_surface_is_drawn_as_it_is_deformed(character: Character) -> None:
    surface = character.surface
    assert np.array_equal(surface.vertex, np.arange(len(character.vertices)))
    assert np.array_equal(surface.faces, character.faces)
    assert surface.colors.shape == (len(character.vertices), 4)
    assert surface.colors.dtype == np.float32
    assert surface.colors.min() >= 0.0
    assert surface.colors.max() <= 1.0
    assert len(np.unique(surface.colors, axis=0)) > 4
    assert (surface.colors[:, 3] == 1.0).all()
    assert np.allclose(character.in_file_coordinates(character.vertices), character.vertices)


def test_an_unknown_name_is_told_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"'dragon'.*squid, cactus, trex, paper, mannequin"):
        builtin_character("dragon")


def test_the_stored_page_is_the_one_that_the_code_makes() -> None:
    pytest.importorskip("pygel3d")
    from runtime.characters.builtin import paper
    from runtime.characters.builtin.build import built

    fresh, stored = built(paper.sculpt()), builtin_character("paper")
    assert np.array_equal(fresh["faces"], stored.faces)
    assert np.allclose(fresh["vertices"], stored.vertices, atol=1e-4)


@pytest.fixture(scope="module")
def blob() -> Sculpture:
    solid = smooth_union(0.1, ellipsoid((0, 0, 0), 0.4), tube([(0, 0, 0), (0.7, 0, 0)], [0.2, 0.1]))
    spot = in_front(0.0)(ellipsoid((0, 0, 0), 0.15))
    return Sculpture(
        solid,
        (-0.6, -0.6, -0.6),
        (1.0, 0.6, 0.6),
        0.09,
        "#000000",
        (Paint(spot, "#ffffff"),),
        (Limb("spine", np.zeros((1, 3))),),
    )


def test_meshing_lies_on_the_solid_and_draws_outlines_round(blob: Sculpture) -> None:
    pytest.importorskip("manifold3d")
    pytest.importorskip("pygel3d")
    vertices, faces = meshed(blob)
    assert trimesh.Trimesh(vertices, faces, process=False).is_watertight
    assert np.median(np.abs(blob.solid(vertices))) < 1e-6
    assert np.abs(blob.solid(vertices)).max() < 0.05 * blob.edge
    white = painted(blob, vertices, crispness=1e-3)[:, 0] > 0.5
    sides = white[faces]
    border = np.unique(faces[sides.any(axis=1) & ~sides.all(axis=1)][:, :])
    rim = np.hypot(vertices[border, 0], vertices[border, 1])[white[border]]
    assert np.abs(rim - 0.15).max() < 0.012
    assert np.percentile(np.abs(rim - 0.15), 80) < 1e-3


def test_meshing_twice_gives_the_same(blob: Sculpture) -> None:
    pytest.importorskip("manifold3d")
    pytest.importorskip("pygel3d")
    first, second = meshed(blob), meshed(blob)
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1], second[1])


def test_split_keeps_the_surface_closed_and_in_place() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    vertices, faces = np.asarray(sphere.vertices), np.asarray(sphere.faces)
    finer, pieces = split(vertices, faces, vertices[faces].mean(axis=1)[:, 1] > 0.5)
    mesh = trimesh.Trimesh(finer, pieces, process=False)
    assert mesh.is_watertight
    assert len(pieces) > len(faces)
    assert mesh.area == pytest.approx(sphere.area, rel=1e-12)
    assert mesh.volume == pytest.approx(sphere.volume, rel=1e-12)


def test_signed_distances_of_known_points() -> None:
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    assert ellipsoid((0, 0, 0), 1.0)(points) == pytest.approx([-1.0, 1.0, 2.0])
    assert tube([(0, 0, 0), (0, 3, 0)], [0.05, 0.05])(points[[0, 2]]) == pytest.approx([-0.05] * 2)
    drum = lathe([(0, -1), (1, -1), (1, 1), (0, 1)], 0.0)
    assert drum(points) == pytest.approx([0.0, 1.0, 2.0])  # the axis is part of the outline
    hollow = smooth_difference(1e-9, ellipsoid((0, 0, 0), 1.0), ellipsoid((0, 0, 0), 0.5))
    assert hollow(points[:1]) == pytest.approx([0.5])


def test_a_smooth_union_is_no_thinner_than_either_part() -> None:
    points = np.random.default_rng(5).normal(size=(200, 3))
    one, two = ellipsoid((0, 0, 0), 0.8), ellipsoid((1, 0, 0), 0.6)
    joined = smooth_union(0.2, one, two)(points)
    assert (joined <= np.minimum(one(points), two(points)) + 1e-12).all()
    assert (joined >= np.minimum(one(points), two(points)) - 0.05 - 1e-12).all()


def test_curves_pass_evenly_and_tapers_do_not_overshoot() -> None:
    path = curve([(0, 0, 0), (1, 1, 0), (2, 0, 0), (3, 1, 0)], 40)
    bones = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert bones.max() / bones.min() < 1.02
    assert path[[0, -1]] == pytest.approx(np.array([(0, 0, 0), (3, 1, 0)]), abs=1e-12)
    radii = taper([0.3, 0.3, 0.1, 0.1], 50)
    assert radii.max() <= 0.3 + 1e-12
    assert radii.min() >= 0.1 - 1e-12


def test_limbs_hang_where_they_say() -> None:
    limbs = (Limb("spine", np.eye(3)), Limb("arm", np.ones((2, 3)), "spine1"))
    skeleton = grow(limbs)
    assert skeleton.names == ("spine0", "spine1", "spine2", "arm0", "arm1")
    assert skeleton.parents.tolist() == [-1, 0, 1, 1, 3]
