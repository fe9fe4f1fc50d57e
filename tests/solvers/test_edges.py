import numpy as np

from solvers.edges import edge_lengths, stretch, unique_edges


def test_two_triangles_share_an_edge() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    assert unique_edges(vertices, faces).tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]


def test_edges_without_length_are_left_out() -> None:
    vertices = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]])
    assert unique_edges(vertices, np.array([[0, 1, 2]])).tolist() == [[0, 2], [1, 2]]
    assert len(unique_edges(np.zeros((3, 3)), np.array([[0, 1, 2]]))) == 0


def test_no_faces_no_edges() -> None:
    assert unique_edges(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)).shape == (0, 2)


def test_what_is_longer_and_what_is_shorter_is_stretched() -> None:
    edges = np.array([[0, 1], [0, 2], [1, 2]])
    rest = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
    lengths = edge_lengths(rest, edges)
    assert lengths.tolist() == [3.0, 4.0, 5.0]
    deformed = np.array([[0.0, 0, 0], [6, 0, 0], [0, 0, 1]])
    expected = [1.0, 0.75, abs(np.sqrt(37.0) / 5.0 - 1.0)]
    np.testing.assert_allclose(stretch(deformed, edges, lengths), expected, rtol=1e-15)
    turned = np.asfortranarray(deformed @ [[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    np.testing.assert_allclose(stretch(turned, edges, lengths), expected, rtol=1e-15)
