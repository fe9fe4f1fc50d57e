"""Reduces a dense surface to fewer of its own vertices: same topology, evenly spread.

The edges collapse in the order of their lengths. A vertex is merged into a neighbour, which stays
in place, so a handle at a coarse vertex is a handle at the same vertex of the dense surface. An
edge counts as longer the more its collapse would move the surface (Garland and Heckbert 1997,
Surface simplification using quadric error metrics, section 4). So fingers keep their shape, and
flat parts still get even triangles, which deform better than long slivers.

Separate parts stay separate, and no component vanishes. A collapse must pass the link condition
(Dey et al. 1999, Topology preserving edge contraction), may not turn a face over, may not close an
opening, and may not remove a component's last face.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel, parallel_kernel

DEVIATION = 8.0  # factor of the surface's deviation in the cost of a collapse
_GROWTH = 1.3  # of the largest cost in a round, after a round with too few collapses
_TOO_FEW = 0.02  # of the vertices
_COARSEST = 1.0  # squared, in diagonals: no edge is longer
_STEEPEST = 0.5  # cosine of the largest turn of a face in one collapse
_SLIVER = 0.06  # area over sum of squared edges, 0.144 at best; a thinner face may not get thinner

_SMOOTH, _BORDER, _LOCKED = 0, 1, 2  # vertices that may merge: freely, along the border, never

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Decimation:
    """A coarse surface within a dense one.

    Attributes:
        kept: (C,) the kept vertices of the dense surface, ascending; coarse vertex c is kept[c].
        faces: (F', 3) the coarse faces, into the C coarse vertices.
        cluster: (N,) the coarse vertex into which each dense vertex was merged along edges; -1 for
            a vertex without a proper face.
    """

    kept: Ints
    faces: Ints
    cluster: Ints


class _Mesh(NamedTuple):
    """A triangle mesh with a list of corners for each vertex: first[v], then following[e].

    `quadrics` (N, 11) hold each vertex's squared distance to planes, weighted by area, as the upper
    triangle of a 4x4 matrix by rows, and the area. `into` (N,) is the vertex into which a vertex
    was merged, itself at first. `mark` (N,) is scratch space of a collapse.
    """

    points: Floats
    faces: Ints
    alive: Flags
    first: Ints
    last: Ints
    following: Ints
    quadrics: Floats
    kind: Ints
    into: Ints
    mark: Ints


def decimate(vertices: Floats, faces: Ints, count: int) -> Decimation:
    """Merge vertices until `count` are left, or until the topology allows no more.

    The same arrays always give the same surface.

    Args:
        vertices: (N, 3) finite, any unit.
        faces: (F, 3); may have boundaries, several components, degenerate and non-manifold ones.
        count: the number of vertices to keep.
    """
    mesh = _prepare(vertices, faces)
    left = len(np.unique(mesh.faces))
    limit, clock = 0.0, 0
    while left > count and limit < _COARSEST:
        pairs = mesh.faces[mesh.alive][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        costs = np.empty(len(pairs))
        _collapse_costs(mesh, pairs, costs)
        limit = limit or float(np.percentile(costs, 20.0)) or 1e-30
        short = np.flatnonzero(costs <= limit)
        short = short[np.argsort(costs[short], kind="stable")]
        done, clock = _collapse_short(mesh, pairs[short], limit, left - count, clock)
        if done < _TOO_FEW * left:
            limit *= _GROWTH
        left -= done
    return _compact(mesh)


def _prepare(vertices: Floats, faces: Ints) -> _Mesh:
    count = len(vertices)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = float(np.linalg.norm(high - low)) or 1.0
    proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    triangles = np.ascontiguousarray(faces[proper], dtype=np.int64)
    mesh = _Mesh(
        points=np.ascontiguousarray((vertices - low) / size),
        faces=triangles,
        alive=np.ones(len(triangles), dtype=bool),
        first=np.full(count, -1),
        last=np.full(count, -1),
        following=np.full(triangles.size, -1),
        quadrics=np.zeros((count, 11)),
        kind=_kinds(count, triangles),
        into=np.arange(count),
        mark=np.full(count, -1),
    )
    _link_corners(mesh)
    _hold_borders(mesh)
    return mesh


def _edge_uses(count: int, faces: Ints) -> tuple[Ints, Ints, Ints]:
    """Every edge (E, 2), the number of its faces (E,), and one of its half-edges (E,)."""
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    keys, half, uses = np.unique(
        sides[:, 0] * count + sides[:, 1], return_index=True, return_counts=True
    )
    return np.stack([keys // count, keys % count], axis=1), uses, half


def _kinds(count: int, faces: Ints) -> Ints:
    """Whether a vertex is inside the surface, on its border, or on an edge of 3 faces or more."""
    edges, uses, _ = _edge_uses(count, faces)
    kind = np.full(count, _SMOOTH)
    kind[edges[uses == 1]] = _BORDER
    kind[edges[uses > 2]] = _LOCKED
    return kind


def _hold_borders(mesh: _Mesh) -> None:
    """Keep border edges in place by planes through them; Garland and Heckbert, section 6."""
    edges, uses, half = _edge_uses(len(mesh.points), mesh.faces)
    edges, half = edges[uses == 1], half[uses == 1]
    tail, head = (mesh.points[edges[:, end]] for end in range(2))
    a, b, c = (mesh.points[mesh.faces[half // 3, corner]] for corner in range(3))
    across = np.cross(head - tail, np.cross(b - a, c - a))
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    normal = across / np.where(lengths > 0.0, lengths, 1.0)
    plane = np.column_stack([normal, -np.einsum("ij,ij->i", normal, tail)])
    weight = np.einsum("ij,ij->i", head - tail, head - tail)
    i, j = np.triu_indices(4)
    quadrics = weight[:, None] * plane[:, i] * plane[:, j]
    for end in range(2):
        for column in range(10):
            mesh.quadrics[:, column] += np.bincount(
                edges[:, end], quadrics[:, column], minlength=len(mesh.points)
            )


def _compact(mesh: _Mesh) -> Decimation:
    """Number the kept vertices, and find the kept vertex of every vertex."""
    root = mesh.into
    while not np.array_equal(root[root], root):
        root = root[root]
    faces = mesh.faces[mesh.alive]
    kept = np.unique(faces)
    number = np.full(len(root), -1)
    number[kept] = np.arange(len(kept))
    return Decimation(kept, number[faces], number[root])


@kernel
def _link_corners(mesh: _Mesh) -> None:
    """List each vertex's corners, and sum up the quadrics of its faces."""
    points, faces = mesh.points, mesh.faces
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        n0, n1, n2, _ = _normal(points, a, b, c)
        area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        s = 1.0 / area if area > 0.0 else 0.0
        n0, n1, n2 = n0 * s, n1 * s, n2 * s
        n3 = -(n0 * points[a, 0] + n1 * points[a, 1] + n2 * points[a, 2])
        for k in range(3):
            v, e = faces[f, k], 3 * f + k
            q = mesh.quadrics[v]
            q[0], q[1], q[2] = q[0] + area * n0 * n0, q[1] + area * n0 * n1, q[2] + area * n0 * n2
            q[3], q[4], q[5] = q[3] + area * n0 * n3, q[4] + area * n1 * n1, q[5] + area * n1 * n2
            q[6], q[7], q[8] = q[6] + area * n1 * n3, q[7] + area * n2 * n2, q[8] + area * n2 * n3
            q[9], q[10] = q[9] + area * n3 * n3, q[10] + area
            if mesh.first[v] < 0:
                mesh.first[v] = e
            else:
                mesh.following[mesh.last[v]] = e
            mesh.last[v] = e


@kernel
def _normal(points: Floats, a: int, b: int, c: int) -> tuple[float, float, float, float]:
    """Twice the area times the normal of a triangle, and the sum of its squared edges."""
    u0, u1, u2 = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    v0, v1, v2 = (
        points[c, 0] - points[a, 0],
        points[c, 1] - points[a, 1],
        points[c, 2] - points[a, 2],
    )
    w0, w1, w2 = v0 - u0, v1 - u1, v2 - u2
    squares = u0 * u0 + u1 * u1 + u2 * u2 + v0 * v0 + v1 * v1 + v2 * v2
    squares += w0 * w0 + w1 * w1 + w2 * w2
    return u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0, squares


@kernel
def _cost(mesh: _Mesh, a: int, b: int) -> float:
    """The cost of merging a into b: the edge's length and the surface's deviation, squared."""
    x, y, z = mesh.points[b, 0], mesh.points[b, 1], mesh.points[b, 2]
    d0, d1, d2 = mesh.points[a, 0] - x, mesh.points[a, 1] - y, mesh.points[a, 2] - z
    error = _distance2(mesh.quadrics[a], x, y, z) + _distance2(mesh.quadrics[b], x, y, z)
    area = mesh.quadrics[a, 10] + mesh.quadrics[b, 10]
    deviation = max(error, 0.0) / max(area, 1e-300)
    return float(d0 * d0 + d1 * d1 + d2 * d2 + DEVIATION * DEVIATION * deviation)


@kernel
def _distance2(q: Floats, x: float, y: float, z: float) -> float:
    """The weighted squared distance of a point to the planes of a quadric (11,)."""
    row0 = q[0] * x + 2.0 * (q[1] * y + q[2] * z + q[3])
    row1 = q[4] * y + 2.0 * (q[5] * z + q[6])
    row2 = q[7] * z + 2.0 * q[8]
    return float(row0 * x + row1 * y + row2 * z + q[9])


@parallel_kernel
def _collapse_costs(mesh: _Mesh, pairs: Ints, out: Floats) -> None:
    """The cost of collapsing each edge (E, 2) in its cheaper direction, out (E,)."""
    for i in prange(len(pairs)):
        a, b = pairs[i, 0], pairs[i, 1]
        out[i] = min(_cost(mesh, a, b), _cost(mesh, b, a))


@kernel
def _collapse_short(
    mesh: _Mesh, pairs: Ints, limit: float, wanted: int, clock: int
) -> tuple[int, int]:
    """Collapse edges (E, 2) in their order, up to the cost `limit` and the number `wanted`.

    Returns the number of collapses, and the clock, whose values mark a collapse's neighbours.
    """
    done = 0
    for i in range(len(pairs)):
        if done == wanted:
            break
        a, b = pairs[i, 0], pairs[i, 1]
        if mesh.into[a] != a or mesh.into[b] != b:
            continue
        forward, backward = _cost(mesh, a, b), _cost(mesh, b, a)
        if backward < forward:
            a, b = b, a
            forward, backward = backward, forward
        for way in range(2):
            if (backward if way else forward) > limit:
                break
            clock += 2
            if _may_collapse(mesh, a, b, clock):
                _collapse(mesh, a, b)
                done += 1
                break
            a, b = b, a
    return done, clock


@kernel
def _may_collapse(mesh: _Mesh, a: int, b: int, clock: int) -> bool:
    if mesh.kind[a] == _LOCKED:
        return False
    shared = _link_faces(mesh, a, b, clock)
    if shared == 0 or (mesh.kind[a] == _BORDER and shared != 1):
        return False
    return _keeps_shape(mesh, a, b)


@kernel
def _link_faces(mesh: _Mesh, a: int, b: int, clock: int) -> int:
    """The number of faces of edge (a, b), or 0 if its collapse would change the topology."""
    shared = common = others_of_a = others_of_b = 0
    e = mesh.first[b]
    while e >= 0:
        if mesh.alive[e // 3]:
            others_of_b += 1
            for k in range(3):
                mesh.mark[mesh.faces[e // 3, k]] = clock
        e = mesh.following[e]
    e = mesh.first[a]
    while e >= 0:
        f = e // 3
        if mesh.alive[f]:
            has_b, near = False, 0
            for k in range(3):
                v = mesh.faces[f, k]
                has_b = has_b or v == b
                if v not in (a, b) and mesh.mark[v] >= clock:
                    near += 1
                    if mesh.mark[v] == clock:  # count a vertex of two faces once
                        common += 1
                        mesh.mark[v] = clock + 1
            if has_b:
                shared += 1
            else:
                others_of_a += 1
                if near == 2:  # would coincide with a face of b
                    return 0
        e = mesh.following[e]
    if shared > 2 or common != shared or others_of_a + others_of_b - shared == 0:
        return 0
    return shared


@kernel
def _keeps_shape(mesh: _Mesh, a: int, b: int) -> bool:
    """Whether no face of a turns over or becomes a sliver when a is merged into b."""
    e = mesh.first[a]
    while e >= 0:
        f = e // 3
        x, y, z = mesh.faces[f, 0], mesh.faces[f, 1], mesh.faces[f, 2]
        if mesh.alive[f] and b not in (x, y, z):
            n0, n1, n2, squares = _normal(mesh.points, x, y, z)
            x, y, z = b if x == a else x, b if y == a else y, b if z == a else z
            m0, m1, m2, new_squares = _normal(mesh.points, x, y, z)
            area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            new_area = math.sqrt(m0 * m0 + m1 * m1 + m2 * m2)
            if n0 * m0 + n1 * m1 + n2 * m2 < _STEEPEST * area * new_area:
                return False
            # Compared without division: a face may have no extent.
            sliver = new_area < _SLIVER * new_squares
            if sliver and new_area * squares < area * new_squares:
                return False
        e = mesh.following[e]
    return True


@kernel
def _collapse(mesh: _Mesh, a: int, b: int) -> None:
    """Merge a into b, which takes over a's faces."""
    e = mesh.first[a]
    while e >= 0:
        f = e // 3
        if mesh.faces[f, 0] == b or mesh.faces[f, 1] == b or mesh.faces[f, 2] == b:
            mesh.alive[f] = False
        elif mesh.alive[f]:
            mesh.faces[f, e % 3] = b
        e = mesh.following[e]
    mesh.following[mesh.last[b]] = mesh.first[a]
    mesh.last[b] = mesh.last[a]
    mesh.into[a] = b
    for k in range(11):
        mesh.quadrics[b, k] += mesh.quadrics[a, k]
