"""The cotangent Laplacian on closed forms, identities and broken meshes."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.linear.laplacian import (
    LEAST_WEIGHT,
    cotangent_edges,
    cotangent_laplacian,
    half_cotangents,
    sum_over_faces,
)


def test_right_isosceles_triangle_has_cotangents_zero_one_one():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2]])
    np.testing.assert_allclose(half_cotangents(vertices, faces), [[0.0, 0.5, 0.5]], atol=1e-15)
    w = LEAST_WEIGHT  # of the hypotenuse, which is opposite a right angle
    expected = [[1.0, -0.5, -0.5], [-0.5, 0.5 + w, -w], [-0.5, -w, 0.5 + w]]
    np.testing.assert_allclose(cotangent_laplacian(vertices, faces).toarray(), expected, atol=1e-15)


def test_regular_tetrahedron_has_equal_weights():
    vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    L = cotangent_laplacian(vertices, faces).toarray()
    w = 1.0 / np.sqrt(3.0)  # the cotangent of 60 degrees, half from each side
    np.testing.assert_allclose(L, 4 * w * np.eye(4) - w, atol=1e-14)


def _noisy_grid(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    n = 12
    u, v = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    vertices = np.stack([u, v, 0 * u], axis=-1).reshape(-1, 3) + rng.normal(0, 0.4, (n * n, 3))
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate(
        [np.stack([a, a + n, a + n + 1], axis=1), np.stack([a, a + n + 1, a + 1], axis=1)]
    )
    return vertices, faces


def test_symmetric_with_zero_rows_and_positive_weights():
    vertices, faces = _noisy_grid(np.random.default_rng(1))
    L = cotangent_laplacian(vertices, faces)
    assert abs(L - L.T).max() == 0.0
    assert abs(L.sum(axis=1)).max() < 1e-12 * abs(L).max()
    assert (cotangent_edges(vertices, faces).weights >= LEAST_WEIGHT).all()
    assert np.linalg.eigvalsh(L.toarray())[:2] == pytest.approx([0.0, 0.0], abs=0.1)
    assert np.linalg.eigvalsh(L.toarray())[1] > 1e-9


@pytest.mark.parametrize("scale", [1e-8, 1e-3, 1e3, 1e8])
def test_weights_do_not_depend_on_scale(scale: float):
    vertices, faces = _noisy_grid(np.random.default_rng(2))
    small = half_cotangents(scale * vertices, faces)
    np.testing.assert_allclose(small, half_cotangents(vertices, faces), rtol=1e-9, atol=1e-12)


def test_slivers_are_bounded_and_stay_positive_semi_definite():
    rng = np.random.default_rng(3)
    for height in (0.0, 1e-300, 1e-12, 1e-4):
        vertices = np.array([[0.0, 0, 0], [1, 0, 0], [rng.uniform(-1, 2), height, 0]])
        halves = half_cotangents(vertices, np.array([[0, 1, 2]]))
        assert np.isfinite(halves).all()
        a, b, c = 2 * halves[0]
        assert a * b + b * c + c * a >= -1e-6  # the condition for the face's energy
        assert abs(halves).max() <= 1001


def test_a_point_and_a_repeated_corner_weigh_nothing():
    vertices = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 1, 1]])
    assert not half_cotangents(vertices, np.array([[0, 1, 2], [0, 0, 3]])).any()
    edges = sum_over_faces(np.array([[0, 0, 3]]), np.ones((1, 3)), 4)
    assert len(edges.pairs) == 0


def test_an_edge_of_three_faces_sums_over_all():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1]])
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    edges = cotangent_edges(vertices, faces)
    shared = edges.weights[(edges.pairs == [0, 1]).all(axis=1)]
    apex = 2 * np.arctan(0.5)
    np.testing.assert_allclose(shared, 1.5 / np.tan(apex), rtol=1e-12)
