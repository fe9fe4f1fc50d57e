"""Quality of a deformed surface: energy in closed form, and which triangles are inverted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.surface.surface_quality import SLIVER, SurfaceQuality


def sheet(side: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A flat square of unit cells in the plane z = 0."""
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1).astype(float)
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate(
        [np.stack([a, a + 1, a + side + 1], 1), np.stack([a, a + side + 1, a + side], 1)]
    )
    return vertices, faces


def measured(vertices: np.ndarray, faces: np.ndarray, deformed: np.ndarray) -> SurfaceQuality:
    quality = SurfaceQuality(vertices, faces)
    quality.measure(deformed)
    return quality


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.sampled_from([1e-3, 1.0, 1e3]))
def test_a_rigid_motion_is_in_order_at_any_scale(seed: int, scale: float) -> None:
    random = np.random.default_rng(seed)
    vertices, faces = sheet()
    rest = scale * (vertices + random.normal(0.0, 0.2, vertices.shape))
    found = measured(rest, faces, Rotation.random(rng=random).apply(rest) + 5 * scale)
    assert found.energy < 1e-12
    assert not found.inverted.any()


@settings(deadline=None)
@given(x=st.floats(0.3, 3.0), y=st.floats(0.3, 3.0))
def test_energy_of_a_stretch_is_the_sum_of_squared_strains(x: float, y: float) -> None:
    vertices, faces = sheet()
    found = measured(vertices, faces, vertices * [x, y, 1.0])
    assert found.energy == pytest.approx((x - 1) ** 2 + (y - 1) ** 2, abs=1e-9)
    assert not found.inverted.any()


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), share=st.floats(0.1, 0.9))
def test_in_the_plane_inverted_is_what_lies_face_down(seed: int, share: float) -> None:
    vertices, faces = sheet()
    rng = np.random.default_rng(seed)
    moved = vertices.copy()
    lone = 12 * np.arange(2, 10, 4)[:, None] + np.arange(2, 10, 4)  # no two in one triangle
    chosen = lone.ravel()[rng.random(lone.size) < share]
    moved[chosen, :2] += 1.7 * rng.normal(size=(len(chosen), 2))
    a, b, c = (moved[faces[:, k]] for k in range(3))
    height = np.cross(b - a, c - a)[:, 2]
    longest = max(np.linalg.norm(s, axis=1).max() for s in (b - a, c - b, a - c))
    clear = abs(height) > 2.0 * SLIVER * longest**2
    turn = Rotation.random(rng=rng)
    found = measured(vertices, faces, turn.apply(moved))
    assert ((height < 0) & clear).sum() <= found.inverted.sum() <= (height < 0).sum()


def test_a_sharp_bend_is_not_inverted_but_a_fold_against_the_ring_is() -> None:
    vertices, faces = sheet()
    angle = np.clip(vertices[:, 0] - 4.0, 0.0, 3.0)  # three radians over three cells
    x = np.cumsum(np.r_[0.0, np.cos(np.clip(np.arange(0.5, 11.0) - 4.0, 0.0, 3.0))])
    z = np.cumsum(np.r_[0.0, np.sin(np.clip(np.arange(0.5, 11.0) - 4.0, 0.0, 3.0))])
    column = vertices[:, 0].astype(int)
    bent = np.stack([x[column], vertices[:, 1], z[column]], axis=1)
    assert angle.max() == 3.0
    assert measured(vertices, faces, bent).inverted.sum() == 0
    folded = bent.copy()
    folded[12 * 6 + 2] += [0.0, 1.8, 0.0]
    assert measured(vertices, faces, folded).inverted.sum() > 0


def test_slivers_are_never_inverted() -> None:
    vertices, faces = sheet()
    middle = (vertices[60] + vertices[61]) / 2 + [0.0, 1e-3, 0.0]
    points = np.vstack([vertices, middle])
    needles = np.vstack([faces, [[60, 61, 144]]])
    moved = points.copy()
    moved[144] -= [0.0, 2e-3, 0.0]
    assert measured(points, needles, moved).inverted.sum() == 0
