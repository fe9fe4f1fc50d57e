"""Which side of a surface is up, and whether it faces backwards, on shapes in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.surface.upright import faces_away, stands_along_z, surface_samples


def test_a_round_thing_has_no_back() -> None:
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rings = [np.column_stack([np.cos(angle), np.full(40, y), np.sin(angle)]) for y in range(8)]
    assert not faces_away(np.vstack(rings))


@pytest.mark.parametrize(
    "vertices", [np.zeros((3, 3)), np.eye(3)[[0, 0, 1]], np.eye(3)], ids=["point", "line", "face"]
)
def test_the_least_surfaces_have_samples(vertices: np.ndarray) -> None:
    assert np.isfinite(surface_samples(vertices, np.array([[0, 1, 2]]))).all()


def test_a_snake_lies_as_it_lies() -> None:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(24, z)]) for z in np.linspace(0, 30, 60)])
    assert not stands_along_z(points)
    assert stands_along_z(points * [5.0, 1.0, 1.0])  # a board that wide does stand
