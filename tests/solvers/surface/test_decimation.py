"""Decimation keeps topology, borders and components, spreads vertices evenly, and repeats."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay

from solvers.surface.decimation import Decimation, decimate

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def torus(around: int = 90, across: int = 40) -> tuple[Floats, Ints]:
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corners = [
        (((u + i) % around) * across + (v + j) % across).ravel()
        for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    a, b, c, d = corners
    big, small = 2 * np.pi * u / around, 2 * np.pi * v / across
    ring = 1.0 + 0.4 * np.cos(small)
    vertices = np.stack([ring * np.cos(big), 0.4 * np.sin(small), ring * np.sin(big)], axis=-1)
    return vertices.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def plate(n: int, height: float = 0.0) -> tuple[Floats, Ints]:
    line = np.linspace(0.0, 1.0, n)
    x, y = np.meshgrid(line, line, indexing="ij")
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    return np.stack([x, y, np.full_like(x, height)], axis=-1).reshape(-1, 3), faces


def edge_uses(faces: Ints) -> tuple[Ints, Ints]:
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(sides, axis=0, return_counts=True)
    return edges, uses


def pieces(count: int, faces: Ints) -> Ints:
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def coarse_vertices(vertices: Floats, found: Decimation) -> Floats:
    return vertices[found.kept]


def test_a_closed_surface_keeps_its_topology_and_its_shape():
    vertices, faces = torus()
    found = decimate(vertices, faces, 500)
    assert len(found.kept) == 500
    assert (np.diff(found.kept) > 0).all()
    edges, uses = edge_uses(found.faces)
    assert (uses == 2).all()
    assert 500 - len(edges) + len(found.faces) == 0  # Euler's number of a torus
    points = coarse_vertices(vertices, found)
    a, b, c = (points[found.faces[:, corner]] for corner in range(3))
    middle = (a + b + c) / 3
    from_ring = np.hypot(np.hypot(middle[:, 0], middle[:, 2]) - 1.0, middle[:, 1])
    assert np.abs(from_ring - 0.4).max() < 0.08


def test_triangles_are_even():
    vertices, faces = torus()
    found = decimate(vertices, faces, 700)
    corners = coarse_vertices(vertices, found)[found.faces]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    quality = 2 * np.sqrt(3) * area / (lengths**2).sum(axis=1)  # 1 for an equilateral triangle
    assert np.percentile(quality, 5) > 0.35
    assert lengths.max() < 3.5 * np.median(lengths)


def test_every_vertex_belongs_to_one_near_it_along_the_surface():
    vertices, faces = torus()
    found = decimate(vertices, faces, 500)
    assert (found.cluster[found.kept] == np.arange(500)).all()
    gap = np.linalg.norm(vertices - coarse_vertices(vertices, found)[found.cluster], axis=1)
    assert gap.max() < 0.4
    # A cluster is connected: within it, every vertex is reached over edges of its own.
    sides = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    inner = sides[found.cluster[sides[:, 0]] == found.cluster[sides[:, 1]]]
    graph = coo_array((np.ones(len(inner)), inner.T), shape=(len(vertices),) * 2)
    assert connected_components(graph, directed=False)[0] == 500


def test_a_border_keeps_its_corners():
    vertices, faces = plate(60)
    found = decimate(vertices, faces, 300)
    points = coarse_vertices(vertices, found)
    edges, uses = edge_uses(found.faces)
    border = edges[uses == 1]
    along = np.linalg.norm(points[border[:, 0]] - points[border[:, 1]], axis=1)
    assert along.sum() == pytest.approx(4.0)
    assert len(points) - len(edges) + len(found.faces) == 1


def test_close_plates_never_meet_and_no_piece_is_lost():
    low, faces = plate(40)
    high, _ = plate(40, height=1e-3)  # a fraction of an edge apart
    buttons = np.array(
        [[2.0, 0, 0], [2.01, 0, 0], [2, 0.01, 0], [3, 0, 0], [3.01, 0, 0], [3, 1, 0]]
    )
    vertices = np.concatenate([low, high, buttons])
    start = 2 * len(low)
    loose = np.array([[start, start + 1, start + 2], [start + 3, start + 4, start + 5]])
    faces = np.concatenate([faces, faces + len(low), loose])
    found = decimate(vertices, faces, 200)
    before, after = pieces(len(vertices), faces), pieces(len(found.kept), found.faces)
    assert len(np.unique(after)) == len(np.unique(before)) == 4
    assert (before[found.kept][found.cluster] == before).all()


def test_a_thin_ring_is_not_cut():
    """Its cross-section has three vertices: a shorter edge than those would cut it through."""
    vertices, faces = torus(100, 3)
    distance = np.hypot(vertices[:, 0], vertices[:, 2])[:, None]
    vertices *= (1.0 + 0.02 * (distance - 1.0)) / distance * [1, 0, 1] + [0, 0.02, 0]
    found = decimate(vertices, faces, 30)
    edges, uses = edge_uses(found.faces)
    assert (uses == 2).all()
    assert len(found.kept) - len(edges) + len(found.faces) == 0
    corners = np.sort(found.faces, axis=1)
    assert len(np.unique(corners, axis=0)) == len(corners)


def test_no_face_of_a_flat_sheet_turns_over():
    points = np.random.default_rng(0).random((3_000, 2)) ** 2  # far denser in one corner
    faces = Delaunay(points).simplices.astype(np.int64)
    vertices = np.column_stack([points, np.zeros(len(points))])

    def areas(of: Ints) -> Floats:
        a, b, c = (vertices[of[:, corner], :2] for corner in range(3))
        u, v = b - a, c - a
        return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]

    faces = np.where(areas(faces)[:, None] > 0.0, faces, faces[:, ::-1])
    found = decimate(vertices, faces, 200)
    assert (areas(found.kept[found.faces]) > 0.0).all()


def test_what_cannot_be_simplified_is_left():
    rng = np.random.default_rng(0)
    soup = rng.normal(size=(300, 3))
    found = decimate(soup, np.arange(300).reshape(-1, 3), 30)
    assert len(found.kept) == 300


def test_broken_surfaces_stay_whole():
    sheet, faces = plate(30)
    third = sheet[:, [2, 1, 0]].copy()  # shares the line x = 0 with the sheet, as a third wing
    mirrored = sheet * [-1, 1, 1]
    vertices = np.concatenate([sheet, third, mirrored, [[9.0, 9, 9]]])
    wings = np.concatenate([faces, faces + len(sheet), faces + 2 * len(sheet)])
    seam = np.arange(30)
    merge = np.arange(len(vertices))
    merge[len(sheet) + seam] = seam
    merge[2 * len(sheet) + seam] = seam
    odd = [[5, 5, 9], [40, 41, 40]]  # no triangles at all
    found = decimate(vertices, np.concatenate([merge[wings], odd]), 400)
    assert len(found.kept) <= 420
    _, uses = edge_uses(found.faces)
    assert (uses == 3).sum() == 29  # the seam is kept as it is
    assert np.isin(seam, found.kept).all()
    used = np.unique(merge[wings])
    assert (found.cluster[used] >= 0).all()
    assert found.cluster[-1] == -1


def test_flat_faces_do_no_harm():
    vertices, faces = plate(20)
    vertices[:, 1] = 0.0  # all of it is one line
    found = decimate(vertices, faces, 50)
    assert (found.cluster >= 0).all()


@pytest.mark.parametrize("scale", [2.0**-10, 2.0**10])
def test_scale_changes_nothing(scale: float):
    vertices, faces = torus(40, 20)
    assert (
        decimate(vertices * scale, faces, 100).kept == decimate(vertices, faces, 100).kept
    ).all()


def test_threads_change_nothing():
    vertices, faces = torus()
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        alone = decimate(vertices, faces, 400)
    finally:
        numba.set_num_threads(before)
    together = decimate(vertices, faces, 400)
    for field in ("kept", "faces", "cluster"):
        assert (getattr(alone, field) == getattr(together, field)).all()
