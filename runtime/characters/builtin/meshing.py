"""From a signed distance to a watertight mesh of even triangles that follow painted outlines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from runtime.characters.builtin.sculpture import Focus, Sculpture
from runtime.characters.builtin.signed_distance import Field

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

_FAIR_ANGLE = np.radians(16.0)
"""Outlines never make a triangle's smallest angle smaller than this."""


def level_set(sculpture: Sculpture) -> tuple[Array, Faces]:
    """The surface of the solid, as vertices (n, 3) [m] and faces (m, 3).

    The focus is magnified before meshing and shrunk back after, so its triangles are smaller.
    """
    from manifold3d import Manifold  # noqa: PLC0415

    bounds = [*sculpture.lower, *sculpture.upper]
    asked: list[tuple[float, float, float]] = []

    def ask(x: float, y: float, z: float) -> float:
        asked.append((x, y, z))
        return -1.0

    # The first run only learns where manifold3d samples, so that NumPy can do it all at once.
    Manifold.level_set(ask, bounds, sculpture.edge)
    inward = -sculpture.solid(_shrunk(np.array(asked), sculpture.focus))
    known = dict(zip(asked, inward.tolist(), strict=True))
    mesh = Manifold.level_set(lambda *at: known[at], bounds, sculpture.edge).to_mesh()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=np.float64)
    return _shrunk(vertices, sculpture.focus), np.asarray(mesh.tri_verts, dtype=np.int64)


def _shrunk(points: Array, focus: Focus) -> Array:
    offset = points - np.array(focus.center)
    falloff = np.exp(-np.sum(offset**2, axis=1) / focus.radius**2)
    moved: Array = points - (1.0 - focus.shrink) * falloff[:, None] * offset
    return moved


def gradient(field: Field, points: Array, step: float = 1e-4) -> Array:
    """The gradient (n, 3) of `field` from its values at the corners of a small tetrahedron."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
    around = (points[None] + step * corners[:, None]).reshape(-1, 3)
    values = field(around).reshape(4, -1)
    slope: Array = values.T @ corners / (4.0 * step)
    return slope


def projected(field: Field, points: Array, slope: Array, reach: float) -> Array:
    """Points moved to the zero set of `field` by a Newton step of at most `reach` [m]."""
    square = np.maximum(np.sum(slope**2, axis=1), 1e-12)
    step = (field(points) / square)[:, None] * slope
    length = np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
    moved: Array = points - step * np.minimum(1.0, reach / length)
    return moved


def neighbours(count: int, faces: Faces) -> csr_array:
    """The averaging operator (n, n): each row is the mean over a vertex's neighbours."""
    tails = faces[:, [0, 1, 2, 1, 2, 0]].ravel()
    heads = faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    matrix = coo_array((np.ones(len(tails)), (tails, heads)), shape=(count, count)).tocsr()
    matrix.data[:] = 1.0
    return csr_array(matrix.multiply(1.0 / matrix.sum(axis=1)[:, None]))


def relaxed(vertices: Array, faces: Faces, field: Field, edge: float, rounds: int) -> Array:
    """Vertices slid along the surface towards the mean of their neighbours.

    Source: M. Botsch, L. Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004,
    section 4 (tangential smoothing).
    """
    average = neighbours(len(vertices), faces)
    for _ in range(rounds):
        vertices = _slid(vertices, average, field, edge)
    return vertices


def _slid(vertices: Array, average: csr_array, field: Field, edge: float) -> Array:
    slope = gradient(field, vertices)
    square = np.maximum(np.sum(slope**2, axis=1, keepdims=True), 1e-12)
    pull = average @ vertices - vertices
    pull -= np.sum(pull * slope, axis=1, keepdims=True) / square * slope
    return projected(field, vertices + 0.6 * pull, slope, 0.5 * edge)


def meshed(sculpture: Sculpture) -> tuple[Array, Faces]:
    """The sculpture's surface: its own mesh if it brings one, else its level set made even.

    Edges are flipped towards six neighbours a vertex, and vertices relaxed after each sweep.
    """
    field, edge = sculpture.solid, sculpture.edge
    if sculpture.mesh is None:
        vertices, faces = level_set(sculpture)
        vertices = relaxed(vertices, faces, field, edge, 8)
        for _ in range(3):
            vertices, faces = _flipped(vertices, faces)
            vertices = relaxed(vertices, faces, field, edge, 5)
    else:
        vertices, faces = sculpture.mesh
    outlines = [paint.region for paint in sculpture.paints if paint.softness == 0.0]
    return outlined(vertices, faces, field, outlines, edge), faces


def _flipped(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    from pygel3d import hmesh  # noqa: PLC0415

    mesh = hmesh.Manifold.from_triangles(vertices, faces)
    hmesh.optimize_valency(mesh)
    turned = [list(mesh.circulate_face(face, mode="v")) for face in mesh.faces()]
    return np.array(mesh.positions(), dtype=np.float64), np.array(turned, dtype=np.int64)


def outlined(
    vertices: Array, faces: Faces, field: Field, outlines: Sequence[Field], edge: float
) -> Array:
    """Vertices slid along the surface so that no edge crosses an outline, as far as room allows.

    Of each edge that crosses, the end nearer to the outline is drawn onto it; the others give way.
    """
    average = neighbours(len(vertices), faces)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    for _ in range(12):
        held = np.full(len(vertices), -1)
        for number, outline in enumerate(outlines):
            held[_nearer_ends(outline(vertices), edges, held >= 0)] = number
        near = average @ (average @ (held >= 0).astype(np.float64)) > 0.0
        moved = np.where(near[:, None], _slid(vertices, average, field, edge), vertices)
        for number, outline in enumerate(outlines):
            on = np.flatnonzero(held == number)
            moved[on] = _onto_outline(moved[on], field, outline, edge)
        vertices = _fair(vertices, moved, faces)
    return vertices


def _fair(before: Array, after: Array, faces: Faces) -> Array:
    """`after`, but as `before` round triangles that the move made thin."""
    floor = np.minimum(_FAIR_ANGLE, smallest_angles(before, faces))
    mixed = after.copy()
    while (thin := smallest_angles(mixed, faces) < floor).any():
        mixed[faces[thin]] = before[faces[thin]]
    return mixed


def smallest_angles(vertices: Array, faces: Faces) -> Array:
    """The smallest angle of each triangle (m,) [rad]."""
    sides = vertices[faces[:, [1, 2, 0]]] - vertices[faces]  # (m, 3, 3)
    sides /= np.maximum(np.linalg.norm(sides, axis=2, keepdims=True), 1e-12)
    cosines = -np.einsum("mij,mij->mi", sides, np.roll(sides, 1, axis=1))
    smallest: Array = np.arccos(np.clip(cosines, -1.0, 1.0)).min(axis=1)
    return smallest


def _onto_outline(points: Array, field: Field, outline: Field, edge: float) -> Array:
    for _ in range(4):
        normal, slope = gradient(field, points), gradient(outline, points)
        square = np.maximum(np.sum(normal**2, axis=1, keepdims=True), 1e-12)
        slope = slope - np.sum(slope * normal, axis=1, keepdims=True) / square * normal
        points = projected(outline, points, slope, 0.3 * edge)
        points = projected(field, points, gradient(field, points), 0.5 * edge)
    return points


def _nearer_ends(depth: Array, edges: Faces, taken: NDArray[np.bool_]) -> NDArray[np.int64]:
    ends = depth[edges]
    crossing = np.flatnonzero((ends[:, 0] < 0.0) != (ends[:, 1] < 0.0))
    order = crossing[np.argsort(np.abs(ends[crossing]).min(axis=1), kind="stable")]
    chosen = taken.copy()
    picked: list[int] = []
    for first, second in edges[order]:
        if chosen[first] or chosen[second]:
            continue
        nearer = int(first if abs(depth[first]) <= abs(depth[second]) else second)
        chosen[nearer] = True
        picked.append(nearer)
    return np.array(picked, dtype=np.int64)
