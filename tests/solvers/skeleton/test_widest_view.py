"""The view that shows the most of a skeleton: closed forms, and no view on the grid beats it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solvers.skeleton.tree import Tree
from solvers.skeleton.widest_view import bones_of, shown_length, widest_view

PITCH, LOWEST, HIGHEST = math.radians(8.0), math.radians(1.0), math.radians(80.0)


def toward(azimuth: float, pitch: float) -> np.ndarray:
    return np.array(
        [
            math.sin(azimuth) * math.cos(pitch),
            math.sin(pitch),
            math.cos(azimuth) * math.cos(pitch),
        ]
    )


def test_bones_are_what_joins_the_nodes() -> None:
    tree = Tree(np.array([-1, 0, 1]), np.array([[0.0, 0, 0], [0, 2, 0], [1, 2, 0]]))
    np.testing.assert_allclose(bones_of(tree), [[0, 2, 0], [1, 0, 0]])


def test_a_bone_is_seen_by_the_sine_of_the_angle_to_the_viewer() -> None:
    bones = np.array([[0.0, 0.0, 3.0]])
    assert shown_length(bones, np.array([0.0, 0.0, 1.0])) == pytest.approx(0.0)
    assert shown_length(bones, np.array([1.0, 0.0, 0.0])) == pytest.approx(1.0)
    slanted = np.array([math.sin(0.3), 0.0, math.cos(0.3)])
    assert shown_length(bones, slanted) == pytest.approx(math.sin(0.3))
    assert shown_length(np.zeros((2, 3)), slanted) == 1.0


def test_what_faces_the_front_is_seen_from_the_front() -> None:
    flat = np.array([[1.0, 0.2, 0.0], [-1.0, 0.2, 0.0], [0.0, 1.0, 0.0]])
    azimuth, pitch = widest_view(flat, PITCH, LOWEST, HIGHEST)
    assert azimuth == pytest.approx(0.0, abs=1e-9)
    assert pitch == pytest.approx(PITCH)


def test_what_lies_along_the_depth_is_seen_from_the_side() -> None:
    animal = np.array([[0.0, 0.0, 4.0], [0.0, -1.0, 0.1], [0.0, -1.0, -0.1]])
    azimuth, _ = widest_view(animal, PITCH, LOWEST, HIGHEST)
    assert abs(azimuth) > math.radians(70.0)


def test_what_lies_on_the_floor_is_seen_from_above() -> None:
    star = np.array([[math.cos(a), 0.0, math.sin(a)] for a in np.arange(5) * 2.0 * np.pi / 5])
    _, pitch = widest_view(star, PITCH, LOWEST, HIGHEST)
    assert pitch > math.radians(60.0)


def test_no_other_view_shows_much_more() -> None:
    random = np.random.default_rng(1)
    for _ in range(10):
        bones = random.standard_normal((30, 3)) * random.uniform(0.1, 3.0, 3)
        found = shown_length(bones, toward(*widest_view(bones, PITCH, LOWEST, HIGHEST)))
        others = random.uniform((-np.pi, LOWEST), (np.pi, HIGHEST), (300, 2))
        most = max(float(shown_length(bones, toward(*view))) for view in others)
        assert found >= 0.985 * most
