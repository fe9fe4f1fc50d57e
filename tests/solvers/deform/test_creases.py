"""Folded triangles are flattened in the shown surface, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.arap import ArapSolver
from solvers.deform.arap_cells import SPOKES, build_cells
from solvers.deform.creases import PARTS, Creases


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


def folded_sheet(turn: Rotation) -> tuple[Creases, np.ndarray, np.ndarray]:
    """A turned sheet with a vertex pushed over its neighbours, and its cells' turns."""
    solver = ArapSolver(POINTS, FACES, CORNERS)
    cells = build_cells(POINTS, FACES, SPOKES).cells
    x = solver.solve(turn.apply(POINTS[CORNERS]), 3)
    x[112] += turn.apply([2.6, 0.3, 0.0])
    R = np.tile(turn.as_matrix().ravel(), (len(POINTS), 1))
    return Creases(POINTS, FACES, cells), x, R


@pytest.mark.parametrize("angle", [0.0, 2.5])
def test_a_vertex_pushed_over_its_neighbours_comes_back_between_them(angle: float):
    turn = Rotation.from_rotvec([0.6 * angle, -0.8 * angle, 0.0])
    creases, x, R = folded_sheet(turn)
    before = x.copy()
    assert folded(before, turn) > 0
    for _ in range(PARTS):  # a part of the triangles in each frame
        x[:] = before
        known = creases.flatten_folds(x, R)
    assert known == folded(before, turn)
    assert folded(x, turn) == 0
    moved = np.flatnonzero(np.abs(x - before).max(axis=1) > 0.0)
    assert 112 in moved
    assert np.linalg.norm(POINTS[moved] - POINTS[112], axis=1).max() < 6.0, "only what is near"


def test_what_is_not_folded_is_not_touched():
    solver = ArapSolver(POINTS, FACES, CORNERS)
    answer = solver.solve(POINTS[CORNERS] * [1.2, 0.9, 1.0], 3)
    before = answer.copy()
    assert solver.flatten_folds(answer) == 0
    np.testing.assert_array_equal(answer, before)


def test_a_solver_irons_what_it_shows_and_goes_on_from_what_it_had():
    """The middle of a sheet is held where it must fold over; the folds go, the next frame stays."""
    held = [*CORNERS, 110, 114]
    away = np.zeros((6, 3))
    away[4:, 0] = 5.0, -5.0
    flat = Rotation.identity()
    flattened, plain = (ArapSolver(POINTS, FACES, held) for _ in range(2))
    for _ in range(2 * PARTS):
        shown, folds = flattened.solve(POINTS[held] + away, 2), plain.solve(POINTS[held] + away, 2)
        flattened.flatten_folds(shown)
    assert folded(folds, flat) > 0
    assert folded(shown, flat) == 0
    np.testing.assert_array_equal(
        flattened.solve(POINTS[held] + away, 2), plain.solve(POINTS[held] + away, 2)
    )
