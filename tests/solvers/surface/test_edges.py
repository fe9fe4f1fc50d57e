"""Edges of a mesh, and their stretch."""

import numpy as np

from solvers.surface.edges import Edges


def test_two_triangles_share_an_edge() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    assert Edges.of(vertices, faces).ends.tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]


def test_edges_without_length_are_left_out() -> None:
    vertices = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]])
    assert Edges.of(vertices, np.array([[0, 1, 2]])).ends.tolist() == [[0, 2], [1, 2]]
    assert len(Edges.of(np.zeros((3, 3)), np.array([[0, 1, 2]])).ends) == 0


def test_no_faces_no_edges() -> None:
    edges = Edges.of(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    assert edges.ends.shape == (0, 2)
    assert edges.lengths.shape == (0,)


def test_what_is_longer_and_what_is_shorter_is_stretched() -> None:
    rest = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
    edges = Edges.of(rest, np.array([[0, 1, 2]]))
    assert edges.lengths.tolist() == [3.0, 4.0, 5.0]
    deformed = np.array([[0.0, 0, 0], [6, 0, 0], [0, 0, 1]])
    expected = [1.0, 0.75, abs(np.sqrt(37.0) / 5.0 - 1.0)]
    np.testing.assert_allclose(edges.stretch(deformed), expected, rtol=1e-15)
    turned = np.asfortranarray(deformed @ [[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_allclose(edges.stretch(turned), expected, rtol=1e-15)
