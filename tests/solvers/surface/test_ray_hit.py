"""Rays: closed forms on one triangle, and the same hits as trimesh on deformed surfaces."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_triangle import ray_triangle_id

from solvers.surface.ray_hit import ray_hit

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
FACE = np.array([[0, 1, 2]])


def test_a_ray_through_a_triangle_hits_it_where_it_crosses_its_plane() -> None:
    hit = ray_hit(TRIANGLE, FACE, (0.2, 0.3, 5.0), (0.0, 0.0, -2.0))
    assert hit is not None
    assert (hit.face, hit.corner) == (0, 0)
    assert hit.distance == pytest.approx(2.5)
    np.testing.assert_allclose(hit.shares, (0.5, 0.2, 0.3))


def test_both_sides_count_and_the_nearest_corner_is_told() -> None:
    hit = ray_hit(TRIANGLE, FACE, (0.1, 0.8, -1.0), (0.0, 0.0, 1.0))
    assert hit is not None
    assert hit.corner == 2


@pytest.mark.parametrize(
    ("origin", "direction"),
    [
        ((0.6, 0.6, 1.0), (0.0, 0.0, -1.0)),  # beside it
        ((0.2, 0.2, 1.0), (0.0, 0.0, 1.0)),  # away from it
        ((0.2, 0.2, 1.0), (1.0, 0.0, 0.0)),  # along it
    ],
)
def test_a_ray_that_misses_hits_nothing(origin: tuple, direction: tuple) -> None:
    assert ray_hit(TRIANGLE, FACE, origin, direction) is None


def test_triangles_without_area_and_corners_that_are_nowhere_are_never_hit() -> None:
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    nowhere = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, np.nan, 0.0]])
    for vertices in (line, nowhere):
        assert ray_hit(vertices, FACE, (0.2, 0.0, 1.0), (0.0, 0.0, -1.0)) is None


def test_of_two_surfaces_the_nearer_one_is_hit() -> None:
    vertices = np.concatenate([TRIANGLE, TRIANGLE + np.array([0.0, 0.0, 0.5])])
    hit = ray_hit(vertices, np.array([[0, 1, 2], [3, 4, 5]]), (0.2, 0.2, 2.0), (0.0, 0.0, -1.0))
    assert hit is not None
    assert hit.face == 1


class EveryTriangle:
    """Trimesh's index of triangles, which needs a library of its own; this one leaves none out."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self.bounds, self._count = mesh.bounds.ravel(), len(mesh.faces)

    def intersection(self, _: object) -> list[int]:
        return list(range(self._count))


def test_hits_are_those_of_trimesh() -> None:
    random = np.random.default_rng(3)
    sphere = trimesh.creation.icosphere(2)
    vertices = sphere.vertices * (1.0, 1.6, 0.7) + 0.1 * np.sin(5.0 * sphere.vertices[:, ::-1])
    mesh = trimesh.Trimesh(vertices, sphere.faces, process=False)
    origins = 4.0 * random.standard_normal((100, 3))
    directions = random.standard_normal((100, 3)) - origins
    faces, rays, places = ray_triangle_id(
        mesh.triangles, origins, directions, tree=EveryTriangle(mesh), multiple_hits=True
    )
    missed = 0
    for ray, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        hit, theirs = ray_hit(vertices, sphere.faces, origin, direction), rays == ray
        if not theirs.any():
            assert hit is None
            missed += 1
            continue
        assert hit is not None
        ways = np.linalg.norm(places[theirs] - origin, axis=1)
        assert hit.face == faces[theirs][int(np.argmin(ways))]
        met = origin + hit.distance * direction
        np.testing.assert_allclose(met, places[theirs][int(np.argmin(ways))], atol=1e-9)
        np.testing.assert_allclose(hit.shares @ vertices[sphere.faces[hit.face]], met, atol=1e-9)
    assert 0 < missed < 90
