"""A tree of boxes finds the same blocked lines as a look at every triangle."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.surface.sightlines import ROOM, box_tree, is_blocked
from tests.solvers.bars import bar


def crossed(vertices: np.ndarray, faces: np.ndarray, start: np.ndarray, end: np.ndarray) -> bool:
    """Whether any triangle without the start as a corner crosses the line."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    matrices = np.stack([b - a, c - a, np.broadcast_to(start - end, a.shape)], axis=2)
    regular = abs(np.linalg.det(matrices)) > 1e-14
    u, v, t = np.linalg.solve(matrices[regular], (start - a[regular])[..., None])[..., 0].T
    return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-3) & (t < 1 - 1e-3)).any())


@pytest.mark.parametrize("count", [1, 5, 300])
def test_lines_through_a_heap_of_triangles(count: int) -> None:
    random = np.random.default_rng(count)
    corners = random.uniform(-1.0, 1.0, (count, 1, 3)) + random.normal(0, 0.15, (count, 3, 3))
    vertices, faces = corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
    tree, one_part = box_tree(vertices, faces), np.zeros(3 * count, dtype=np.int64)
    found, expected = [], []
    for end in random.uniform(-1.2, 1.2, (60, 3)):
        start = int(random.integers(3 * count))
        others = faces[(faces != start).all(axis=1)]
        found.append(is_blocked(tree, one_part, start, end, np.empty(ROOM, dtype=np.int64)))
        expected.append(len(others) > 0 and crossed(vertices, others, vertices[start], end))
    assert found == expected
    assert any(found) or count < 300
    assert not all(found)


def test_a_vertex_sees_the_inside_of_its_own_part_only() -> None:
    vertices, faces = bar()
    count, waiting = len(vertices), np.empty(ROOM, dtype=np.int64)
    both = np.concatenate([vertices, vertices * [1.0, 0.5, 0.5]])  # a thinner bar inside
    tree = box_tree(both, np.concatenate([faces, faces + count]))
    one, two = np.zeros(2 * count, dtype=np.int64), np.repeat([0, 1], count)
    for v in range(0, count - 2, 7):
        axis = np.array([vertices[v, 0] * 0.9 + 0.2, 0.0, 0.0])
        beyond = axis - 2.0 * (vertices[v] - axis)
        assert not is_blocked(tree, two, v, axis, waiting)
        assert is_blocked(tree, two, v, beyond, waiting)
        assert is_blocked(tree, one, v, axis, waiting)
