"""Folded triangles are laid flat in what is shown, and nothing else is touched."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver


def sheet(n: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """A flat grid of n by n vertices, a unit apart."""
    y, x = np.divmod(np.arange(n * n), n)
    points = np.stack([x, y, 0 * x], axis=1).astype(float)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    return points, np.concatenate(
        [np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)]
    )


POINTS, FACES = sheet()
CORNERS = [0, 14, 210, 224]


def folded(vertices: np.ndarray, turn: Rotation) -> int:
    a, b, c = (vertices[FACES[:, k]] for k in range(3))
    return int((np.cross(b - a, c - a) @ turn.apply([0.0, 0.0, 1.0]) < 0.0).sum())


@pytest.mark.parametrize("angle", [0.0, 2.5])
def test_a_vertex_pushed_over_its_neighbours_comes_back_between_them(angle: float):
    turn = Rotation.from_rotvec([0.6 * angle, -0.8 * angle, 0.0])
    solver = ArapSolver(POINTS, FACES, CORNERS)
    answer = solver.solve(turn.apply(POINTS[CORNERS]), 3)
    creased = answer.copy()
    creased[112] += turn.apply([2.6, 0.3, 0.0])
    assert folded(creased, turn) > 0
    before = creased.copy()
    assert solver.iron(creased) == folded(before, turn)
    assert folded(creased, turn) == 0
    moved = np.flatnonzero(np.abs(creased - before).max(axis=1) > 0.0)
    assert 112 in moved
    assert np.linalg.norm(POINTS[moved] - POINTS[112], axis=1).max() < 6.0, "only what is near"


def test_what_is_not_folded_is_not_touched():
    solver = ArapSolver(POINTS, FACES, CORNERS)
    answer = solver.solve(POINTS[CORNERS] * [1.2, 0.9, 1.0], 3)
    before = answer.copy()
    assert solver.iron(answer) == 0
    np.testing.assert_array_equal(answer, before)


def test_the_next_frame_knows_nothing_of_it():
    targets = POINTS[CORNERS] * [1.1, 1.0, 1.0]
    ironed, plain = (ArapSolver(POINTS, FACES, CORNERS) for _ in range(2))
    shown = ironed.solve(targets, 2)
    plain.solve(targets, 2)
    shown[112] += [2.6, 0.0, 0.0]
    assert ironed.iron(shown) > 0
    np.testing.assert_array_equal(ironed.solve(targets, 2), plain.solve(targets, 2))
