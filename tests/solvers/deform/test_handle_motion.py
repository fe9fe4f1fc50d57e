"""Rigid motions of groups of handles, and the surface that moves with them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.deform.handle_motion import (
    Influences,
    farthest_motion,
    fit_motions,
    follow,
    follow_one_group,
)


def moved(points: np.ndarray, motions: np.ndarray, group: int = 0) -> np.ndarray:
    out = np.empty_like(points)
    follow(points, follow_one_group(np.full(len(points), group)), motions, out)
    return out


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi - 1e-9, np.pi])
def test_a_rigid_motion_is_found_for_any_angle(angle: float):
    rng = np.random.default_rng(0)
    source, probe = rng.normal(size=(9, 3)), rng.normal(size=(20, 3))
    for axis in [*np.eye(3), [0.6, 0.0, -0.8]]:
        turn = Rotation.from_rotvec(angle * np.asarray(axis))
        motions = fit_motions(source, turn.apply(source) + 5.0, np.zeros(9, dtype=int), 1)
        np.testing.assert_allclose(moved(probe, motions), turn.apply(probe) + 5.0, atol=1e-13)
        assert farthest_motion(motions, source, np.zeros(9, dtype=int))[0] == pytest.approx(angle)


def test_a_group_of_one_point_turns_with_all_the_others():
    rng = np.random.default_rng(1)
    source = rng.normal(size=(10, 3))
    group_of = np.array([0] * 9 + [1])
    turn = Rotation.from_rotvec([0.3, -1.0, 0.4])
    motions = fit_motions(source, turn.apply(source) - 2.0, group_of, 2)
    probe = rng.normal(size=(5, 3))
    np.testing.assert_allclose(moved(probe, motions, 1), turn.apply(probe) - 2.0, atol=1e-12)


def test_two_points_turn_as_little_as_they_can():
    source = np.array([[0.0, 0, 0], [1, 0, 0]])
    target = np.array([[0.0, 0, 0], [0, 1, 0]])
    motions = fit_motions(source, target, np.zeros(2, dtype=int), 1)
    probe = np.array([[0.0, 0, 1], [1, 0, 0]])
    np.testing.assert_allclose(moved(probe, motions), [[0, 0, 1], [0, 1, 0]], atol=1e-5)


def test_one_handle_only_shifts():
    motions = fit_motions(np.ones((1, 3)), np.full((1, 3), 3.0), np.zeros(1, dtype=int), 1)
    np.testing.assert_allclose(moved(np.eye(3), motions), np.eye(3) + 2.0, atol=1e-15)


def test_half_a_turn_blends_to_a_quarter_without_collapse():
    rng = np.random.default_rng(2)
    source = np.tile(rng.normal(size=(6, 3)), (2, 1))
    group_of = np.repeat([0, 1], 6)
    target = source.copy()
    target[6:] = Rotation.from_rotvec([0, 0, np.pi - 1e-6]).apply(source[6:])
    motions = fit_motions(source, target, group_of, 2)
    point, out = np.array([[1.0, 0.0, 0.5]]), np.empty((1, 3))
    halves = Influences(np.array([[0, 1, 0, 1]], dtype=np.uint32), np.full((1, 4), 0.25))
    follow(point, halves, motions, out)
    np.testing.assert_allclose(np.linalg.norm(out), np.linalg.norm(point), rtol=1e-12)
    np.testing.assert_allclose(abs(out), [[0.0, 1.0, 0.5]], atol=1e-5)


def test_the_farthest_motion_is_that_of_the_points_that_a_group_has():
    turn = Rotation.from_rotvec([0.0, 0.0, 0.5])
    source = np.array([[4.0, 0, 0], [5, 1, 0], [4, 1, 3], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    target = np.vstack([source[:3] + np.array([0.0, 0.0, 0.2]), turn.apply(source[3:])])
    group_of = np.repeat([0, 1], 3)
    motions = fit_motions(source, target, group_of, 2)
    angle, path = farthest_motion(motions, source, group_of)
    assert angle == pytest.approx(0.5)
    assert path == pytest.approx(2.0 * np.sin(0.25))
    group_of[3:] = -1  # nobody's
    assert farthest_motion(motions, source, group_of)[1] == pytest.approx(0.2)
