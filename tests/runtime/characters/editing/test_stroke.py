"""Parts from strokes: round, closed, even, and with a skeleton along the middle."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from devices.errors import InputError
from runtime.characters.editing.carried import sheet_of
from runtime.characters.editing.merging import merge
from runtime.characters.editing.stroke import part_of_stroke, radii_by_speed
from tests.solvers.editing.surface.solids import is_watertight, volume

RED = (1.0, 0.0, 0.0)
ARC = np.stack([np.sin(np.linspace(0, 2, 30)), np.cos(np.linspace(0, 2, 30)), np.zeros(30)], axis=1)


def test_a_hand_that_is_slow_draws_thick_and_one_that_is_fast_draws_thin() -> None:
    x = np.array([0.0, 0.01, 0.02, 0.5, 1.0, 1.5, 4.0, 8.0])
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    radii = radii_by_speed(points, np.arange(8.0), 0.1, 0.3)
    assert 0.29 < radii[0] <= 0.3
    assert radii[-1] == 0.1
    assert (np.diff(radii) <= 0.0).all()
    assert_allclose(radii_by_speed(points[3:6], [0.0, 1.0, 2.0], 0.1, 0.3), 0.2)


def test_a_stroke_becomes_a_closed_and_even_tube_with_nodes_along_its_middle() -> None:
    pytest.importorskip("manifold3d")
    part = part_of_stroke("arm", ARC, 0.15, RED)
    sheet = sheet_of(part)
    assert is_watertight(sheet)
    assert_allclose(volume(sheet), 2.0 * np.pi * 0.15**2 + 4 / 3 * np.pi * 0.15**3, rtol=0.08)
    corners = part.vertices[part.faces]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert lengths.max() < 3.0 * np.median(lengths)
    assert_allclose(np.linalg.norm(part.skeleton.rest_positions, axis=1), 1.0, atol=0.02)
    assert len(part.skeleton.names) == 4
    assert part.weights is not None
    assert_allclose(part.weights.sum(axis=1), 1.0)
    assert part.weights.tocsc()[:, [3]].nnz == 0
    start = np.linalg.norm(part.vertices - ARC[0], axis=1) < 0.2
    assert_allclose(part.weights.toarray()[start, 0], 1.0)


def test_radii_are_followed_and_a_dot_is_a_ball() -> None:
    pytest.importorskip("manifold3d")
    line = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    cone = part_of_stroke("horn", line, [0.2, 0.08], RED).vertices
    low, high = np.abs(cone[:, 1] - 0.1) < 0.05, np.abs(cone[:, 1] - 0.9) < 0.05
    assert_allclose(np.hypot(cone[low, 0], cone[low, 2]).max(), 0.19, atol=0.015)
    assert_allclose(np.hypot(cone[high, 0], cone[high, 2]).max(), 0.095, atol=0.015)
    ball = part_of_stroke("eye", [[1.0, 2.0, 3.0]], 0.1, RED)
    assert_allclose(np.linalg.norm(ball.vertices - [1.0, 2.0, 3.0], axis=1), 0.1, atol=0.005)


def test_a_part_from_a_stroke_is_merged_onto_another() -> None:
    pytest.importorskip("manifold3d")
    body = part_of_stroke("body", ARC, 0.15, RED)
    horn = part_of_stroke("horn", ARC[15] * [[1.0], [1.5]], [0.1, 0.05], (0.0, 1.0, 0.0))
    whole = merge(body, horn, 2)
    assert is_watertight(sheet_of(whole))
    assert set(map(tuple, whole.surface.colors[:, :3].tolist())) == {RED, (0.0, 1.0, 0.0)}


def test_a_stroke_that_is_none_says_so_in_one_line() -> None:
    with pytest.raises(InputError, match=r"points \(x, y, z\)"):
        part_of_stroke("arm", np.zeros((0, 3)), 0.1, RED)
    with pytest.raises(InputError, match="positive"):
        part_of_stroke("arm", ARC, 0.0, RED)
    with pytest.raises(InputError, match="30 points has 2 radii"):
        part_of_stroke("arm", ARC, [0.1, 0.2], RED)
    with pytest.raises(InputError, match="draw it thicker"):
        part_of_stroke("arm", ARC, 1e-4, RED)
    with pytest.raises(InputError, match="ascend"):
        radii_by_speed(ARC, np.zeros(30), 0.1, 0.2)
    with pytest.raises(InputError, match="thin <= thick"):
        radii_by_speed(ARC, np.arange(30.0), 0.2, 0.1)
