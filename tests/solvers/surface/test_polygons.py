"""Polygons cut into triangles: covered once, none turned over, fans where they are convex."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.surface.polygons import triangulate
from tests.thorough import examples

U = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]], dtype=float)


def in_space(flat: np.ndarray, seed: int = 0) -> np.ndarray:
    """The corners (n, 3) in a plane that no axis is parallel to."""
    frame = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return flat @ frame[:2] + [3.0, -5.0, 7.0]


def cut(*polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    sizes = np.array([len(polygon) for polygon in polygons])
    found = triangulate(np.concatenate(polygons), sizes)
    return found.corners, found.polygon, found.doubtful


def normals(corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Twice the area (T, 3) of each triangle, along its normal."""
    a, b, c = corners[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def area_and_turned_over(corners: np.ndarray, triangles: np.ndarray) -> tuple[float, int]:
    """The area that the triangles cover, and how many turn against the polygon."""
    outward = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    outward /= np.linalg.norm(outward)
    areas = 0.5 * normals(corners, triangles) @ outward
    return float(np.abs(areas).sum()), int(np.count_nonzero(areas < -1e-12))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("start", range(8))
def test_a_concave_polygon_is_covered_once_from_any_corner(
    start: int, turned: bool, seed: int
) -> None:
    corners = in_space(np.roll(U[::-1] if turned else U, start, axis=0), seed)
    triangles, polygon, doubtful = cut(corners)
    area, turned_over = area_and_turned_over(corners, triangles)
    assert len(triangles) == 6
    assert set(polygon) == {0}
    assert area == pytest.approx(7.0)
    assert turned_over == doubtful == 0


def test_triangles_and_convex_polygons_stay_fans_from_their_first_corner() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)
    hexagon = in_space(np.column_stack([np.cos(angle), np.sin(angle)]))
    triangles, polygon, doubtful = cut(hexagon[:3], hexagon[:4], hexagon[:2], hexagon)
    np.testing.assert_array_equal(
        triangles,
        [[0, 1, 2], [3, 4, 5], [3, 5, 6], [9, 10, 11], [9, 11, 12], [9, 12, 13], [9, 13, 14]],
    )
    np.testing.assert_array_equal(polygon, [0, 1, 1, 3, 3, 3, 3])
    assert doubtful == 0


@pytest.mark.parametrize("start", range(4))
def test_a_concave_quad_is_cut_at_its_inward_corner(start: int) -> None:
    arrow = np.array([[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]])
    corners = in_space(np.roll(arrow, start, axis=0))
    triangles, _, doubtful = cut(corners[:3], corners, corners)
    area, turned_over = area_and_turned_over(corners, triangles[3:] - 7)
    assert area == pytest.approx(0.5)
    assert turned_over == doubtful == 0
    np.testing.assert_array_equal(triangles[3:] - 7, triangles[1:3] - 3)


def test_corners_on_a_straight_side_are_kept() -> None:
    x = [0, 1, 2, 3, 3, 3, 2, 2, 2, 1, 1, 0, 0]
    y = [0, 0, 0, 0, 2, 3, 3, 2, 1, 1, 3, 3, 1]
    ring = np.array([x, y], dtype=float).T
    corners = in_space(ring)
    triangles, _, doubtful = cut(ring @ np.eye(2, 3), corners)
    for triangles_of_one in (triangles[:11], triangles[11:] - 13):
        assert set(triangles_of_one.ravel()) == set(range(13))
        directed = {(int(t[i]), int(t[(i + 1) % 3])) for t in triangles_of_one for i in range(3)}
        rim = {edge for edge in directed if edge[::-1] not in directed}
        assert rim == {(i, (i + 1) % 13) for i in range(13)}  # as the neighbours have it
        area, turned_over = area_and_turned_over(corners, triangles_of_one)
        assert area == pytest.approx(7.0)
        assert turned_over == 0
    assert doubtful == 0


@given(st.integers(4, 40), st.integers(0, 2**32 - 1), st.floats(-6, 6))
@settings(max_examples=examples(60), deadline=None)
def test_star_shaped_polygons_are_covered_at_any_scale(
    count: int, seed: int, exponent: float
) -> None:
    random = np.random.default_rng(seed)
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    radius = random.uniform(0.2, 1.0, count) * 10.0**exponent
    flat = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    corners = np.column_stack([flat, 0.1 * flat[:, 0]])[:, random.permutation(3)]
    triangles, _, doubtful = cut(corners)
    x, y = flat.T
    true = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) * np.sqrt(1.01)
    area, turned_over = area_and_turned_over(corners / 10.0**exponent, triangles)
    assert len(triangles) == count - 2
    assert area * 100.0**exponent == pytest.approx(true, rel=1e-5)
    assert turned_over == doubtful == 0


def test_polygons_that_cross_themselves_are_counted_and_become_fans() -> None:
    bow = np.array([[0.0, 0], [3, 0], [0, 1], [1, 1]])
    crossing = np.array([[0.0, 0], [4, 0], [4, 2], [1, -1], [1, 3], [0, 2]])
    triangles, _, doubtful = cut(in_space(bow), in_space(crossing))
    assert doubtful == 2
    np.testing.assert_array_equal(triangles[2:], [[4, 4 + i, 5 + i] for i in range(1, 5)])


@pytest.mark.parametrize("odd", [np.nan, np.inf, 1e308])
@np.errstate(over="ignore", invalid="ignore")
def test_corners_without_a_place_become_fans(odd: float) -> None:
    corners = in_space(U)
    corners[4, 1] = odd
    triangles, _, _ = cut(corners, np.zeros((5, 3)))
    assert len(triangles) == 9
    assert triangles.max() == 12
