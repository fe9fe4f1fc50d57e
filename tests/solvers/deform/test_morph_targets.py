"""Morph targets on a deformed surface: the deltas turn with it, and cost what they move."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from solvers.deform.morph_targets import MorphedSurface, MorphTargets

Array = NDArray[np.float64]


def sheet(size: int = 20) -> tuple[Array, NDArray[np.int64]]:
    """A square sheet with waves in it: vertices (n, 3) and faces."""
    x, y = np.meshgrid(np.linspace(0, 1, size), np.linspace(0, 1, size))
    z = 0.1 * np.sin(5 * x) * np.cos(3 * y)
    at = np.arange(size * size).reshape(size, size)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces


def targets_of(count: int) -> MorphTargets:
    rng = np.random.default_rng(0)
    some = rng.permutation(count)[: count // 3]
    return MorphTargets.of(
        [
            (some, rng.normal(size=(len(some), 3))),
            (np.arange(0), np.zeros((0, 3))),
            (some[:5], rng.normal(size=(5, 3))),
        ]
    )


def dense(targets: MorphTargets, weights: Array, count: int) -> Array:
    total = np.zeros((count, 3))
    for t, weight in enumerate(weights):
        own = slice(targets.starts[t], targets.starts[t + 1])
        np.add.at(total, targets.vertices[own], weight * targets.deltas[own])
    return total


def test_at_rest_the_deltas_are_added_as_they_are() -> None:
    rest, faces = sheet()
    targets, weights = targets_of(len(rest)), np.array([0.5, 1.0, 0.25])
    moved = rest.copy()
    MorphedSurface(rest, faces, targets).add(weights, moved)
    np.testing.assert_allclose(moved, rest + dense(targets, weights, len(rest)), atol=1e-12)


@pytest.mark.parametrize("turn", [[0.0, 1.2, 0.0], [1.0, 2.0, 3.0], [np.pi, 0.0, 0.0]])
def test_under_a_rigid_motion_the_deltas_turn_with_it(turn: list[float]) -> None:
    rest, faces = sheet()
    targets, weights = targets_of(len(rest)), np.array([1.0, 1.0, -0.5])
    matrix = Rotation.from_rotvec(turn).as_matrix()
    moved = rest @ matrix.T + [1.0, 2.0, 3.0]
    MorphedSurface(rest, faces, targets).add(weights, moved)
    wanted = (rest + dense(targets, weights, len(rest))) @ matrix.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(moved, wanted, atol=1e-12)


def test_on_a_sheet_rolled_to_a_cylinder_each_delta_turns_by_its_own_angle() -> None:
    size = 41
    rest, faces = sheet(size)
    rest[:, 2] = 0.0
    radius = 0.5
    angle = rest[:, 0] / radius
    rolled = np.column_stack([radius * np.sin(angle), rest[:, 1], radius * (1.0 - np.cos(angle))])
    inside = np.flatnonzero((np.abs(rest[:, :2] - 0.5) < 0.49).all(axis=1))
    delta = np.array([0.01, 0.02, 0.03])
    targets = MorphTargets.of([(inside, np.tile(delta, (len(inside), 1)))])
    moved = rolled.copy()
    MorphedSurface(rest, faces, targets).add(np.ones(1), moved)
    along = np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    out = np.column_stack([-np.sin(angle), 0 * angle, np.cos(angle)])
    wanted = delta[0] * along + delta[1] * np.array([0, 1.0, 0]) + delta[2] * out
    np.testing.assert_allclose((moved - rolled)[inside], wanted[inside], atol=2e-4)
    still = np.setdiff1d(np.arange(len(rest)), inside)
    np.testing.assert_array_equal(moved[still], rolled[still])


def test_a_stretched_surface_does_not_stretch_the_deltas() -> None:
    rest, faces = sheet()
    targets = targets_of(len(rest))
    moved = 3.0 * rest
    MorphedSurface(rest, faces, targets).add(np.array([1.0, 0, 0]), moved)
    np.testing.assert_allclose(
        moved - 3.0 * rest, dense(targets, np.array([1.0, 0, 0]), len(rest)), atol=1e-12
    )


def test_vertices_without_area_keep_their_delta_and_nothing_is_nan() -> None:
    rest = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5], [0, 1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 0, 0], [0, 1, 4]])
    targets = MorphTargets.of([(np.arange(5), np.ones((5, 3)))])
    surface = MorphedSurface(rest, faces, targets)
    moved = rest.copy()
    surface.add(np.ones(1), moved)
    np.testing.assert_allclose(moved, rest + 1.0)
    flat = np.zeros_like(rest)
    surface.add(np.ones(1), flat)  # collapsed to a point
    np.testing.assert_array_equal(flat, 1.0)


def test_a_target_of_a_vertex_that_is_not_there_is_refused() -> None:
    rest, faces = sheet(4)
    with pytest.raises(ValueError, match="move vertices"):
        MorphedSurface(rest, faces, MorphTargets.of([(np.array([16]), np.ones((1, 3)))]))
