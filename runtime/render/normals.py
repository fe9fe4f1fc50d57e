"""Vertex normals of a deforming surface: smooth across file seams, sharp at creases."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from runtime.characters.character import Character
from solvers.kernels.compiled import kernel

CREASE = math.radians(62.0)

# The kernels process LANES faces at a time, in one flat array of 6 rows of LANES numbers. With one
# array and constant strides the compiler can prove that nothing overlaps, and so use vector
# instructions (as in solvers/deform/rotation_fit.py).
LANES = 64

_FLAT = 1e-28  # squared sine of a face's angle below which its normal is only rounding error


@dataclass(frozen=True, slots=True, eq=False)
class DrawVertices:
    """Vertices for drawing, split at the file's seams and at creases of the rest shape.

    Attributes:
        welded: (D,) int32; the welded vertex that gives each drawn vertex its position.
        file: (D,) int64; the file vertex that gives it colour and texture coordinates.
        group: (D,) int32; the smoothing group that gives it its normal.
        triangles: (F, 3) int32 into the D drawn vertices, in the character's face order.
        faces: (F, 3) int32 into the welded vertices.
        corner_group: (F, 3) int32; the smoothing group of each corner of a face.
    """

    welded: NDArray[np.int32]
    file: NDArray[np.int64]
    group: NDArray[np.int32]
    triangles: NDArray[np.int32]
    faces: NDArray[np.int32]
    corner_group: NDArray[np.int32]


def split_vertices(character: Character, *, crease: float = CREASE) -> DrawVertices:
    """Split a character's vertices for drawing; edges that turn more than `crease` stay sharp."""
    faces = np.ascontiguousarray(character.faces, dtype=np.int32)
    group = smoothing_groups(character.vertices, faces, crease)
    surface = character.surface
    file = np.asarray(surface.faces, dtype=np.int64).reshape(-1)
    key = file * (int(group.max(initial=0)) + 1) + group
    _, first, triangles = np.unique(key, return_index=True, return_inverse=True)
    return DrawVertices(
        welded=surface.vertex[file[first]].astype(np.int32),
        file=file[first],
        group=group[first],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        faces=faces,
        corner_group=group.reshape(-1, 3),
    )


def smoothing_groups(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], crease: float
) -> NDArray[np.int32]:
    """Return the group number of each corner (3 F,); smooth edges join the corners at a vertex.

    Two faces that run along their common edge in the same direction disagree about inside and
    outside. Their normals would cancel, so such an edge counts as sharp.
    """
    count = len(faces)
    corner = np.arange(3 * count).reshape(-1, 3)
    tail, head = faces, np.roll(faces, -1, axis=1)
    first, second = corner, np.roll(corner, -1, axis=1)  # corners at tail and head
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    edge = (low.astype(np.int64) * len(vertices) + high).ravel()
    order = np.argsort(edge, kind="stable")
    a, b = order[:-1], order[1:]
    same = edge[a] == edge[b]
    opposite = tail.ravel()[a] != tail.ravel()[b]
    normals, area = _unit_face_normals(vertices, faces)
    turn = np.einsum("ij,ij->i", normals[a // 3], normals[b // 3])
    flat = (area[a // 3] == 0.0) | (area[b // 3] == 0.0)
    joined = same & opposite & (flat | (turn >= math.cos(crease)))
    a, b = a[joined], b[joined]
    rows = np.concatenate([first.ravel()[a], second.ravel()[a]])
    columns = np.concatenate([second.ravel()[b], first.ravel()[b]])
    links = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (3 * count,) * 2)
    labels: NDArray[np.int32] = connected_components(links, directed=False)[1]
    return labels.astype(np.int32)


def _unit_face_normals(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(length, 1e-300)[:, None], length


def is_closed(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> bool:
    """Return whether every connected piece is watertight and faces outward."""
    tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = len(vertices)
    forward = np.sort(tail.astype(np.int64) * count + head)
    backward = np.sort(head.astype(np.int64) * count + tail)
    if (np.diff(forward) == 0).any() or not np.array_equal(forward, backward):
        return False
    links = coo_array((np.ones(len(tail), dtype=np.int8), (tail, head)), (count, count))
    piece = connected_components(links, directed=False)[1][faces[:, 0]]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.bincount(piece, weights=np.einsum("ij,ij->i", a, np.cross(b, c)))
    return bool((volume[np.bincount(piece) > 0] > 0.0).all())


class DeformingNormals:
    """Fills the vertex buffer of a deforming surface; reuses its arrays from frame to frame.

    A normal is the sum of the face normals of its smoothing group, each weighted by the face's
    angle at the vertex, so it does not depend on the triangulation. Sums run in the order of the
    faces: two runs agree to the last bit.

    Source: Thurmer and Wuthrich, Computing Vertex Normals from Polygonal Facets, 1998, section 2.
    """

    def __init__(self, split: DrawVertices) -> None:
        self._split = split
        self._lanes = np.zeros(6 * LANES)
        self._sums = np.zeros((int(split.corner_group.max(initial=-1)) + 1, 3))
        self._out = np.zeros((len(split.welded), 6), dtype=np.float32)

    def fill(self, vertices: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return position and unit normal (D, 6) of each drawn vertex for welded vertices (N, 3).

        A normal is zero where no face of its group has an area. The next call overwrites the
        array.
        """
        split = self._split
        _sum_corners(vertices, split.faces, split.corner_group, self._lanes, self._sums)
        _expand(vertices, self._sums, split.welded, split.group, self._out)
        return self._out


@njit(inline="always", error_model="numpy")
def _angle(x: float, y: float) -> float:
    """Return the angle in [0, pi] of (x, y) with y > 0, to 2e-8; atan2 took half the time here.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, 4.4.49.
    """
    side = abs(x)
    t = min(side, y) / max(side, y)
    s = t * t
    turn = 0.1065626393 + s * (
        -0.0752896400 + s * (0.0429096138 + s * (-0.0161657367 + s * 0.0028662257))
    )
    turn = t * (1.0 + s * (-0.3333314528 + s * (0.1999355085 + s * (-0.1420889944 + s * turn))))
    turn = 0.5 * math.pi - turn if y > side else turn
    return math.pi - turn if x < 0.0 else turn


@kernel
def _sum_corners(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    corner_group: NDArray[np.int32],
    lanes: NDArray[np.float64],
    sums: NDArray[np.float64],
) -> None:
    """Sum up the weighted normals of each group's corners, sums (G, 3), in the order of faces."""
    sums[:] = 0.0
    count = faces.shape[0]
    for first in range(0, count, LANES):
        size = min(LANES, count - first)
        _gather_edges(vertices, faces, first, size, lanes)
        _weigh(lanes, size)
        _scatter(lanes, corner_group, first, size, sums)


@kernel
def _gather_edges(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    first: int,
    size: int,
    lanes: NDArray[np.float64],
) -> None:
    """Rows 0 to 2 of `lanes`: a face's edge from its first corner to its second; 3 to 5: third."""
    for k in range(size):
        f = np.uint64(first + k)
        a, b, c = np.uint64(faces[f, 0]), np.uint64(faces[f, 1]), np.uint64(faces[f, 2])
        x, y, z = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        lanes[k] = vertices[b, 0] - x
        lanes[LANES + k] = vertices[b, 1] - y
        lanes[2 * LANES + k] = vertices[b, 2] - z
        lanes[3 * LANES + k] = vertices[c, 0] - x
        lanes[4 * LANES + k] = vertices[c, 1] - y
        lanes[5 * LANES + k] = vertices[c, 2] - z


@kernel
def _weigh(lanes: NDArray[np.float64], size: int) -> None:
    """Turn edges into unit normals (rows 0 to 2) and angles (3 to 5); 0 for faces without area."""
    for k in range(size):
        ux, uy, uz = lanes[k], lanes[LANES + k], lanes[2 * LANES + k]
        vx, vy, vz = lanes[3 * LANES + k], lanes[4 * LANES + k], lanes[5 * LANES + k]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        nn, vv = nx * nx + ny * ny + nz * nz, vx * vx + vy * vy + vz * vz
        uv, uu = ux * vx + uy * vy + uz * vz, ux * ux + uy * uy + uz * uz
        double_area = math.sqrt(nn)
        at_a, at_b = _angle(uv, double_area), _angle(uu - uv, double_area)
        # Selected and not branched to, so that whole vectors of faces stay in step.
        flat = nn <= _FLAT * uu * vv
        scale = 0.0 if flat else 1.0 / double_area
        at_a, at_b = 0.0 if flat else at_a, 0.0 if flat else at_b
        lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = nx * scale, ny * scale, nz * scale
        lanes[3 * LANES + k], lanes[4 * LANES + k] = at_a, at_b
        lanes[5 * LANES + k] = math.pi - at_a - at_b


@kernel
def _scatter(
    lanes: NDArray[np.float64],
    corner_group: NDArray[np.int32],
    first: int,
    size: int,
    sums: NDArray[np.float64],
) -> None:
    """Add each corner's normal, weighted by its angle, to its group's sum."""
    for k in range(size):
        f = np.uint64(first + k)
        x, y, z = lanes[k], lanes[LANES + k], lanes[2 * LANES + k]
        for corner in range(3):
            g = np.uint64(corner_group[f, corner])
            angle = lanes[(3 + corner) * LANES + k]
            sums[g, 0] += x * angle
            sums[g, 1] += y * angle
            sums[g, 2] += z * angle


@kernel
def _expand(
    vertices: NDArray[np.float64],
    sums: NDArray[np.float64],
    welded: NDArray[np.int32],
    group: NDArray[np.int32],
    out: NDArray[np.float32],
) -> None:
    """Position and unit normal of each drawn vertex, out (D, 6)."""
    for d in range(welded.shape[0]):
        v, g = np.uint64(welded[d]), np.uint64(group[d])
        x, y, z = sums[g, 0], sums[g, 1], sums[g, 2]
        scale = 1.0 / max(math.sqrt(x * x + y * y + z * z), 1e-30)
        out[d, 0], out[d, 1], out[d, 2] = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        out[d, 3], out[d, 4], out[d, 5] = x * scale, y * scale, z * scale


@kernel
def bounding_box(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 3) least and greatest corner of (N, 3) points."""
    x0 = x1 = vertices[0, 0]
    y0 = y1 = vertices[0, 1]
    z0 = z1 = vertices[0, 2]
    for i in range(vertices.shape[0]):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    return np.array([[x0, y0, z0], [x1, y1, z1]])
