"""A dense surface follows a coarse one: exactly in rigid motion, closely in bends."""

from __future__ import annotations

import tracemalloc

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from solvers.surface.decimation import decimate
from solvers.surface.embedding import MOST_VERTICES, DenseSurface, Embedding, embed

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def tube(along: int, around: int, length: float = 4.0) -> tuple[Floats, Ints, Floats]:
    """An open tube about the y axis with ripples, its faces, and its axial and angular places."""
    y, angle = np.meshgrid(
        np.linspace(0, length, along), 2 * np.pi * np.arange(around) / around, indexing="ij"
    )
    radius = 0.5 * (1.0 + 0.04 * np.cos(7 * angle) * np.cos(9 * y))
    vertices = np.stack([radius * np.cos(angle), y, radius * np.sin(angle)], -1).reshape(-1, 3)
    grid = np.arange(along * around).reshape(along, around)
    a, b = grid[:-1].ravel(), grid[1:].ravel()
    c, d = np.roll(grid[1:], -1, 1).ravel(), np.roll(grid[:-1], -1, 1).ravel()
    return (
        vertices,
        np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]),
        radius.ravel(),
    )


def bent(points: Floats, curvature: float) -> Floats:
    """The plane bend that takes the y axis to a circle; cross-sections stay rigid."""
    angle = curvature * points[:, 1]
    arm = 1.0 / curvature - points[:, 0]
    return np.stack(
        [1.0 / curvature - arm * np.cos(angle), arm * np.sin(angle), points[:, 2]], axis=-1
    )


def follower(vertices: Floats, faces: Ints, count: int) -> tuple[DenseSurface, Floats, Ints]:
    coarse = decimate(vertices, faces, count)
    rest = np.ascontiguousarray(vertices[coarse.kept])
    places = embed(vertices, coarse.cluster, rest, coarse.faces)
    return DenseSurface(places, rest, coarse.faces), rest, coarse.kept


def test_at_rest_and_under_rigid_motions_it_is_exact():
    vertices, faces, _ = tube(120, 60)
    surface, rest, _ = follower(vertices, faces, 700)
    out = np.empty_like(vertices)
    surface.follow(rest, out)
    assert np.abs(out - vertices).max() < 1e-9
    for rotation in Rotation.random(5, random_state=0):
        shift = np.array([3.0, -20.0, 7.0])
        surface.follow(rotation.apply(rest) + shift, out)
        assert np.abs(out - rotation.apply(vertices) - shift).max() < 1e-9


def test_weights_are_shares_of_one():
    vertices, faces, _ = tube(120, 60)
    held = follower(vertices, faces, 700)[0].embedding
    first = 1.0 - held.weights.sum(axis=1, dtype=np.float64)
    assert held.weights.min() >= 0.0
    assert first.min() >= -1e-7
    assert first.max() <= 1.0
    assert held.corners.dtype == np.uint16


def test_growth_moves_places_and_leaves_detail_as_it_is():
    vertices, faces, _ = tube(80, 40)
    surface, rest, _ = follower(vertices, faces, 500)
    out = np.empty_like(vertices)
    surface.follow(2.0 * rest, out)
    details = surface.embedding.details.astype(np.float64)
    np.testing.assert_allclose(out, 2.0 * (vertices - details) + details, atol=1e-9)


def test_a_bent_tube_keeps_its_ripples_normal_to_its_axis():
    vertices, faces, radius = tube(240, 120)
    surface, rest, _ = follower(vertices, faces, 2400)
    curvature = 0.5 * np.pi / 4.0  # a quarter circle
    out = np.empty_like(vertices)
    surface.follow(bent(rest, curvature), out)
    wanted = bent(vertices, curvature)
    ripple = 0.02
    assert np.linalg.norm(out - wanted, axis=1).max() < 0.25 * ripple
    assert np.sqrt(np.mean((out - wanted) ** 2)) < 0.01 * ripple
    on_axis = bent(vertices * [0.0, 1.0, 0.0], curvature)
    angle = curvature * vertices[:, 1]
    tangent = np.stack([np.sin(angle), np.cos(angle), np.zeros_like(angle)], axis=-1)
    spoke = out - on_axis
    inner = (vertices[:, 1] > 0.1) & (vertices[:, 1] < 3.9)
    assert np.abs(np.einsum("ij,ij->i", spoke, tangent))[inner].max() < 0.15 * ripple
    assert np.abs(np.linalg.norm(spoke, axis=1) - radius)[inner].max() < 0.15 * ripple


def sheet(n: int) -> tuple[Floats, Ints]:
    """A square sheet in the plane x = 0, n by n vertices."""
    line = np.linspace(0.0, 1.0, n)
    y, z = np.meshgrid(line, line, indexing="ij")
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    return np.stack([np.zeros_like(y), y, z], axis=-1).reshape(-1, 3), faces


def test_a_round_bend_shows_no_facets():
    """Even cells turn exactly as the bend does, so that all of the error is the blend's own."""
    (rest, faces), (vertices, _) = sheet(13), sheet(97)
    cell = np.rint(vertices[:, 1:] * 12).astype(np.int64)
    surface = DenseSurface(embed(vertices, cell[:, 0] * 13 + cell[:, 1], rest, faces), rest, faces)
    out = np.empty_like(vertices)
    surface.follow(bent(rest, 1.0), out)
    inner = ((vertices[:, 1:] > 0.1) & (vertices[:, 1:] < 0.9)).all(axis=1)
    facets = (1 / 12) ** 2 / 8  # how far a polygon of such edges cuts into the circle
    assert np.linalg.norm(out - bent(vertices, 1.0), axis=1)[inner].max() < 0.02 * facets


def test_a_finger_is_bound_to_itself_however_near_the_next():
    """Two long plates joined at one end only, nearer to each other than their edges are long."""
    along, across = 150, 20
    s, z = np.meshgrid(np.linspace(-3, 3, along), np.linspace(0, 0.6, across), indexing="ij")
    gap = 0.01
    height = gap * np.tanh(s / 0.05)
    vertices = np.stack([np.abs(s), height, z], axis=-1).reshape(-1, 3)
    a = (np.arange(along - 1)[:, None] * across + np.arange(across - 1)).ravel()
    quads = a + across, a + across + 1
    faces = np.concatenate(
        [np.stack([a, quads[0], quads[1]], 1), np.stack([a, quads[1], a + 1], 1)]
    )
    surface, rest, kept = follower(vertices, faces, 300)
    corners = surface.embedding.corners.astype(np.int64)
    side = np.sign(s).ravel()
    away = np.abs(s).ravel() > 0.4
    assert (side[kept][corners][away] == side[away][:, None]).all()
    # Opened like a book, both covers stay flat and straight.
    moved = rest * [1, 0, 1]
    moved[:, 0] *= side[kept]
    out = np.empty_like(vertices)
    surface.follow(moved, out)
    assert (np.sign(out[:, 0]) == side)[away].all()


def test_a_vertex_of_no_face_rides_with_the_nearest():
    vertices, faces, _ = tube(30, 20)
    lost = np.array([[2.0, 1.0, 0.0]])
    surface, rest, _ = follower(np.concatenate([vertices, lost]), faces, 200)
    turn = Rotation.from_euler("z", 50, degrees=True)
    out = np.empty((len(vertices) + 1, 3))
    surface.follow(turn.apply(rest), out)
    np.testing.assert_allclose(out[-1], turn.apply(lost)[0], atol=1e-7)


def test_a_flat_strip_of_slivers_stays_finite():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [1.5, 0, 0]])
    faces = np.array([[0, 1, 2], [1, 2, 3]])
    places = embed(vertices, np.array([0, 1, 2, 3, -1]), vertices[:4], faces)
    out = np.empty_like(vertices)
    surface = DenseSurface(places, vertices[:4], faces)
    surface.follow(vertices[:4] + 1.0, out)
    np.testing.assert_allclose(out, vertices + 1.0, atol=1e-6)
    surface.follow(np.zeros((4, 3)), out)
    assert np.isfinite(out).all()


def test_singles_are_doubles_rounded():
    vertices, faces, _ = tube(80, 40)
    surface, rest, _ = follower(vertices, faces, 500)
    doubles, singles = np.empty_like(vertices), np.empty(vertices.shape, dtype=np.float32)
    moved = bent(rest, 0.3)
    surface.follow(moved, doubles)
    surface.follow(moved, singles)
    np.testing.assert_array_equal(singles, doubles.astype(np.float32))


def test_threads_change_nothing_and_nothing_is_allocated():
    vertices, faces, _ = tube(240, 120)
    surface, rest, _ = follower(vertices, faces, 700)
    moved, out, alone = bent(rest, 0.3), np.empty_like(vertices), np.empty_like(vertices)
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        surface.follow(moved, alone)
    finally:
        numba.set_num_threads(before)
    peaks = []  # the least counts: other threads of a test run allocate now and then
    for _ in range(5):
        tracemalloc.start()
        try:
            surface.follow(moved, out)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    np.testing.assert_array_equal(out, alone)
    assert min(peaks) < vertices.nbytes / 10


def test_wrong_shapes_are_refused():
    vertices, faces, _ = tube(30, 20)
    surface, rest, _ = follower(vertices, faces, 200)
    with pytest.raises(ValueError, match="expected `moved` of shape"):
        surface.follow(rest[1:], np.empty_like(vertices))
    with pytest.raises(ValueError, match="expected `out` of shape"):
        surface.follow(rest, np.empty((3, 3)))
    none = np.zeros((0, 3), dtype=np.int64)
    with pytest.raises(ValueError, match="coarse vertices"):
        embed(vertices, np.zeros(len(vertices), int), np.zeros((MOST_VERTICES + 1, 3)), none)
    assert isinstance(surface.embedding, Embedding)
