"""Mesh a signed distance: watertight, with even triangles whose edges follow painted outlines."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from runtime.characters.builtin.sculpture import Sculpture
from runtime.characters.builtin.signed_distance import Field

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Mask = NDArray[np.bool_]

_FAIR_ANGLE = np.radians(16.0)
"""Outlines never make a triangle's smallest angle smaller than this."""


def level_set(sculpture: Sculpture) -> tuple[Array, Faces]:
    """The surface of the solid, as vertices (n, 3) [m] and faces (m, 3)."""
    from manifold3d import Manifold  # noqa: PLC0415  # an optional extra

    bounds = [*sculpture.lower, *sculpture.upper]
    asked: list[tuple[float, float, float]] = []

    def ask(x: float, y: float, z: float) -> float:
        asked.append((x, y, z))
        return -1.0

    # The first run only learns where manifold3d samples, so that NumPy can do it all at once.
    Manifold.level_set(ask, bounds, sculpture.edge)
    inward = -sculpture.solid(np.array(asked))
    known = dict(zip(asked, inward.tolist(), strict=True))
    mesh = Manifold.level_set(lambda *at: known[at], bounds, sculpture.edge).to_mesh()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=np.float64)
    return vertices, np.asarray(mesh.tri_verts, dtype=np.int64)


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


def relaxed(
    vertices: Array,
    faces: Faces,
    field: Field,
    edge: float,
    *,
    rounds: int,
    free: Mask | None = None,
) -> Array:
    """Vertices slid along the surface towards the mean of their neighbours; only the `free` ones.

    Source: M. Botsch, L. Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004,
    section 4 (tangential smoothing).
    """
    average = neighbours(len(vertices), faces)
    which = np.arange(len(vertices)) if free is None else np.flatnonzero(free)
    vertices = vertices.copy()
    for _ in range(rounds):
        vertices[which] = _slid(vertices, which, average, field, edge)
    return vertices


def _slid(
    vertices: Array, which: NDArray[np.int64], average: csr_array, field: Field, edge: float
) -> Array:
    points = vertices[which]
    slope = gradient(field, points)
    square = np.maximum(np.sum(slope**2, axis=1, keepdims=True), 1e-12)
    pull = average[which] @ vertices - points
    pull -= np.sum(pull * slope, axis=1, keepdims=True) / square * slope
    return projected(field, points + 0.6 * pull, slope, 0.5 * edge)


def meshed(sculpture: Sculpture) -> tuple[Array, Faces]:
    """The sculpture's surface: its own mesh if it brings one, else its level set made even.

    Edges are flipped towards six neighbours a vertex, and vertices relaxed after each sweep; then
    triangles near outlines are made four times smaller, so that the face is drawn with a fine pen.
    """
    field, edge = sculpture.solid, sculpture.edge
    if sculpture.mesh is None:
        vertices, faces = level_set(sculpture)
        vertices = relaxed(vertices, faces, field, edge, rounds=8)
        for _ in range(3):
            vertices, faces = _flipped(vertices, faces)
            vertices = relaxed(vertices, faces, field, edge, rounds=5)
    else:
        vertices, faces = sculpture.mesh
    outlines = [paint.region for paint in sculpture.paints if paint.softness == 0.0]
    for reach in (1.1 * edge, 0.45 * edge):
        depth = np.min([np.abs(outline(vertices)) for outline in outlines], axis=0)
        chosen = (depth[faces] < reach).any(axis=1)
        free = np.zeros(len(vertices), dtype=bool)
        free[faces[chosen]] = True
        vertices, faces = split(vertices, faces, chosen)
        free = np.concatenate([free, np.ones(len(vertices) - len(free), dtype=bool)])
        for _ in range(2):
            if sculpture.mesh is None:
                vertices, faces = _flipped(vertices, faces)
            vertices = relaxed(vertices, faces, field, edge, rounds=3, free=free)
    vertices = outlined(vertices, faces, field, outlines, 0.25 * edge)
    return _mended(vertices, faces), faces


def _mended(vertices: Array, faces: Faces) -> Array:
    """Corners of what is still thin, in sharp creases, drawn to their neighbours' mean."""
    average = neighbours(len(vertices), faces)
    vertices = vertices.copy()
    for _ in range(20):
        corners = np.unique(faces[smallest_angles(vertices, faces) < _FAIR_ANGLE])
        vertices[corners] += 0.5 * (average[corners] @ vertices - vertices[corners])
    return vertices


def split(vertices: Array, faces: Faces, chosen: Mask) -> tuple[Array, Faces]:
    """The chosen faces cut into four at their edges' middles, their neighbours as that asks."""
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)  # (m, 3, 2)
    edges, number = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    cut = np.zeros(len(edges), dtype=bool)
    cut[number[chosen]] = True
    place = np.full(len(edges), -1)
    place[cut] = len(vertices) + np.arange(np.count_nonzero(cut))
    middle = place[number]
    pieces = [faces[(middle < 0).all(axis=1)]]
    for corner in range(3):
        a, b, c = np.roll(faces, -corner, axis=1).T
        ab, bc, ca = np.roll(middle, -corner, axis=1).T
        one, two = (ab >= 0) & (bc < 0) & (ca < 0), (ab >= 0) & (bc >= 0) & (ca < 0)
        pieces += [np.column_stack(t)[one] for t in ((a, ab, c), (ab, b, c))]
        pieces += [np.column_stack(t)[two] for t in ((a, ab, c), (ab, bc, c), (ab, b, bc))]
        three = (middle >= 0).all(axis=1)
        pieces.append(np.column_stack((a, ab, ca))[three])
    pieces.append(middle[three])
    return np.concatenate([vertices, vertices[edges[cut]].mean(axis=1)]), np.concatenate(pieces)


def _flipped(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    from pygel3d import hmesh  # noqa: PLC0415  # an optional extra

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
    for _ in range(20):
        held = np.full(len(vertices), -1)
        for number, outline in enumerate(outlines):
            held[_nearer_ends(outline(vertices), edges, held >= 0)] = number
        near = np.flatnonzero(average @ (average @ (held >= 0).astype(np.float64)))
        moved = vertices.copy()
        moved[near] = _slid(vertices, near, average, field, edge)
        for number, outline in enumerate(outlines):
            on = np.flatnonzero(held == number)
            moved[on] = _onto_outline(moved[on], field, outline, edge)
        vertices = _fair(vertices, moved, faces)
    return vertices


def _fair(before: Array, after: Array, faces: Faces) -> Array:
    """`after`, but half-way back to `before`, or all of it, round triangles that became thin."""
    floor = np.minimum(_FAIR_ANGLE, smallest_angles(before, faces))
    mixed = after.copy()
    for attempt in count():
        thin = smallest_angles(mixed, faces) < floor
        if not thin.any():
            return mixed
        corners = np.unique(faces[thin])
        share = 0.5 if attempt < 4 else 1.0
        mixed[corners] += share * (before[corners] - mixed[corners])
    raise AssertionError("unreachable: `before` itself is fair")


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
