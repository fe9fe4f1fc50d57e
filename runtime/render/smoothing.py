"""Normals of a deforming surface: smooth across the file's seams, sharp at the shape's creases."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from runtime.character import Character
from solvers.compiled import kernel

CREASE = math.radians(62.0)


@dataclass(frozen=True, slots=True, eq=False)
class DrawVertices:
    """What is drawn, split where the file has a seam or the rest shape a crease.

    Attributes:
        welded: (D,) int32; welded vertex that each drawn vertex follows.
        file: (D,) int64; file vertex that it takes colour and texture coordinates from.
        group: (D,) int32; smoothing group that it takes its normal from.
        triangles: (F, 3) int32 into the D drawn vertices, in the character's face order.
        faces: (F, 3) int32 into the welded vertices.
        group_start: (G + 1,) int32; group g is the corners `group_corners[start[g]:start[g + 1]]`.
        group_corners: (3 F,) int32; corner 3 f + k is the k-th of face f.
    """

    welded: NDArray[np.int32]
    file: NDArray[np.int64]
    group: NDArray[np.int32]
    triangles: NDArray[np.int32]
    faces: NDArray[np.int32]
    group_start: NDArray[np.int32]
    group_corners: NDArray[np.int32]


def split_vertices(character: Character, *, crease: float = CREASE) -> DrawVertices:
    """Split a character's vertices for drawing; edges that turn more than `crease` stay sharp."""
    faces = np.ascontiguousarray(character.faces, dtype=np.int32)
    group = smoothing_groups(character.vertices, faces, crease)
    surface = character.surface
    file = np.asarray(surface.faces, dtype=np.int64).reshape(-1)
    key = file * (int(group.max(initial=0)) + 1) + group
    _, first, triangles = np.unique(key, return_index=True, return_inverse=True)
    corners = np.argsort(group, kind="stable").astype(np.int32)
    sizes = np.bincount(group)
    return DrawVertices(
        welded=surface.vertex[file[first]].astype(np.int32),
        file=file[first],
        group=group[first],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        faces=faces,
        group_start=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32),
        group_corners=corners,
    )


def smoothing_groups(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], crease: float
) -> NDArray[np.int32]:
    """Group number of each corner (3 F,): corners at one vertex joined across its smooth edges.

    Faces that share an edge but run around it the same way disagree about inside and outside;
    their normals would cancel, so that edge counts as sharp.
    """
    count = len(faces)
    corner = np.arange(3 * count).reshape(-1, 3)
    tail, head = faces, np.roll(faces, -1, axis=1)
    first, second = corner, np.roll(corner, -1, axis=1)  # corners at tail and head
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    order = np.lexsort((high.ravel(), low.ravel()))
    a, b = order[:-1], order[1:]
    same = (low.ravel()[a] == low.ravel()[b]) & (high.ravel()[a] == high.ravel()[b])
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
    """Whether no inside can be seen: every piece watertight and turned outward."""
    tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = len(vertices)
    forward = tail.astype(np.int64) * count + head
    backward = head.astype(np.int64) * count + tail
    if len(np.unique(forward)) != len(forward) or not np.isin(forward, backward).all():
        return False
    links = coo_array((np.ones(len(tail), dtype=np.int8), (tail, head)), (count, count))
    piece = connected_components(links, directed=False)[1][faces[:, 0]]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.bincount(piece, weights=np.einsum("ij,ij->i", a, np.cross(b, c)))
    return bool((volume[np.unique(piece)] > 0.0).all())


class DeformingNormals:
    """Fills the vertex buffer of a deforming surface; keeps its scratch from frame to frame.

    A normal is the sum of its smoothing group's face normals, each weighted by the face's angle
    there, so that it does not depend on how the surface was cut into triangles. Sums run in a
    fixed order: two runs agree to the last bit.

    Source: Thurmer and Wuthrich, Computing Vertex Normals from Polygonal Facets, 1998, section 2.
    """

    def __init__(self, split: DrawVertices) -> None:
        self._split = split
        self._corners = np.zeros((3 * len(split.faces), 3))
        self._groups = np.zeros((len(split.group_start) - 1, 3), dtype=np.float32)
        self._out = np.zeros((len(split.welded), 6), dtype=np.float32)

    def fill(self, vertices: NDArray[np.float64]) -> NDArray[np.float32]:
        """Position and unit normal (D, 6) of each drawn vertex, for welded vertices (N, 3).

        The array is overwritten by the next call.
        """
        split = self._split
        _weigh_corners(vertices, split.faces, self._corners)
        _sum_groups(split.group_start, split.group_corners, self._corners, self._groups)
        _expand(vertices, self._groups, split.welded, split.group, self._out)
        return self._out


@njit(inline="always", error_model="numpy")
def _angle(x: float, y: float) -> float:
    """The angle in [0, pi] of (x, y) with y > 0, to 2e-8; atan2 took half the time here.

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
def _weigh_corners(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], out: NDArray[np.float64]
) -> None:
    """Each corner's face normal times its angle (3 F, 3); nothing where a face has no area."""
    for f in range(faces.shape[0]):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        double_area = math.sqrt(nx * nx + ny * ny + nz * nz)
        if double_area == 0.0:
            out[3 * f : 3 * f + 3] = 0.0
            continue
        uv, uu = ux * vx + uy * vy + uz * vz, ux * ux + uy * uy + uz * uz
        at_a = _angle(uv, double_area) / double_area
        at_b = _angle(uu - uv, double_area) / double_area
        at_c = math.pi / double_area - at_a - at_b
        for corner, weight in ((3 * f, at_a), (3 * f + 1, at_b), (3 * f + 2, at_c)):
            out[corner, 0], out[corner, 1], out[corner, 2] = nx * weight, ny * weight, nz * weight


@njit(cache=True, error_model="numpy")
def _sum_groups(
    start: NDArray[np.int32],
    corners: NDArray[np.int32],
    weighted: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Unit normal (G, 3) of each smoothing group; zero where all its faces are degenerate."""
    for g in range(start.shape[0] - 1):
        x = y = z = 0.0
        for i in range(start[g], start[g + 1]):
            x += weighted[corners[i], 0]
            y += weighted[corners[i], 1]
            z += weighted[corners[i], 2]
        length = max(math.sqrt(x * x + y * y + z * z), 1e-30)
        out[g, 0] = x / length
        out[g, 1] = y / length
        out[g, 2] = z / length


@njit(cache=True, error_model="numpy")
def _expand(
    vertices: NDArray[np.float64],
    normals: NDArray[np.float32],
    welded: NDArray[np.int32],
    group: NDArray[np.int32],
    out: NDArray[np.float32],
) -> None:
    for d in range(welded.shape[0]):
        for axis in range(3):
            out[d, axis] = vertices[welded[d], axis]
            out[d, 3 + axis] = normals[group[d], axis]


@njit(cache=True, error_model="numpy")
def bounding_box(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 3) least and greatest corner of (N, 3) points."""
    box = np.empty((2, 3))
    for axis in range(3):
        low = high = vertices[0, axis]
        for i in range(vertices.shape[0]):
            low, high = min(low, vertices[i, axis]), max(high, vertices[i, axis])
        box[0, axis], box[1, axis] = low, high
    return box
