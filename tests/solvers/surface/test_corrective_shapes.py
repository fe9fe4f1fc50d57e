"""Corrective shapes reach every frame to the stated distance, with few shapes."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.surface.corrective_shapes import CorrectiveShapes


def motion(rank: int, frames: int = 200, vertices: int = 50) -> np.ndarray:
    """Frames (F, N, 3) that are sums of `rank` shapes."""
    random = np.random.default_rng(1)
    shares = random.normal(size=(frames, rank))
    return np.einsum("fr,rnc->fnc", shares, random.normal(size=(rank, vertices, 3)))


def added(frames: np.ndarray, within: float) -> CorrectiveShapes:
    shapes = CorrectiveShapes(frames.shape[1], within)
    for start in range(0, len(frames), 64):
        shapes.add(frames[start : start + 64])
    return shapes


def test_as_many_shapes_as_the_motion_has() -> None:
    frames = motion(7)
    shapes = added(frames, 1e-9)
    assert len(shapes.shapes) == 7
    assert shapes.distances(frames, shapes.weights(frames)).max() < 1e-9


@pytest.mark.parametrize("within", [1.0, 0.1, 1e-3])
def test_every_vertex_of_every_frame_is_within_the_bound(within: float) -> None:
    frames = motion(60) * 0.5 ** np.arange(150).reshape(50, 3)
    shapes = added(frames, within)
    assert shapes.distances(frames, shapes.weights(frames)).max() <= within
    assert 0 < len(shapes.shapes) <= 60


def test_a_wider_bound_needs_fewer_shapes() -> None:
    frames = motion(60) * 0.5 ** np.arange(150).reshape(50, 3)
    counts = [len(added(frames, within).shapes) for within in (1.0, 0.1, 1e-3)]
    assert counts == sorted(set(counts))


def test_shapes_are_orthonormal_though_faint_ones_were_added_late() -> None:
    frames = motion(3) + 1e-7 * motion(20)
    rows = added(frames, 1e-9).shapes.reshape(-1, 150)
    np.testing.assert_allclose(rows @ rows.T, np.eye(len(rows)), atol=1e-12)


def test_frames_within_the_bound_need_no_shape() -> None:
    assert len(added(1e-3 * motion(5) / np.abs(motion(5)).max(), 0.01).shapes) == 0
    assert len(added(np.zeros((5, 0, 3)), 0.01).shapes) == 0
