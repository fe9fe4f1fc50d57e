"""Morph targets on a deformed surface: the deltas turn with the surface.

A morph target moves some vertices by deltas that were modelled at rest. On a head that is turned,
or a cheek that is bent, each delta turns with the surface around its vertex. The rotation there is
that of the frame of two spans across the vertex's ring and their normal, as in Sumner and Popovic
(2004, Deformation transfer for triangle meshes, section 3.1), which spans a triangle's frame alike;
it is made orthonormal here, so a stretched cheek does not stretch the smile. Under a rigid motion
of the surface it is exact. A fit to the whole ring costs five times as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.linear.laplacian import Floats

Indices = NDArray[np.int64]
Nine = tuple[float, float, float, float, float, float, float, float, float]

MOST_AROUND = 8  # triangles of a vertex that are looked at for its spans


@dataclass(frozen=True, slots=True, eq=False)
class MorphTargets:
    """T morph targets of a surface of N vertices, one after the other.

    Attributes:
        starts: (T + 1,) where each target begins among the E moves of vertices.
        vertices: (E,) the vertex that each moves.
        deltas: (E, 3) by how much, at rest, at weight 1.
    """

    starts: Indices
    vertices: Indices
    deltas: Floats

    @classmethod
    def of(cls, moves: Sequence[tuple[Indices, Floats]]) -> MorphTargets:
        """Make targets, each of the vertices (e,) that it moves and their deltas (e, 3)."""
        none = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        return cls(
            np.cumsum([0, *(len(vertices) for vertices, _ in moves)]),
            np.concatenate([none[0], *(vertices for vertices, _ in moves)]).astype(np.int64),
            np.concatenate([none[1], *(deltas for _, deltas in moves)]).astype(np.float64),
        )

    def __len__(self) -> int:
        return len(self.starts) - 1

    def turned(self, rotation: Floats) -> MorphTargets:
        """Return the targets of the surface turned, and scaled, by a matrix (3, 3)."""
        return MorphTargets(self.starts, self.vertices, self.deltas @ rotation.T)


class MorphedSurface:
    """Adds weighted morph targets to a deformed surface.

    The cost grows with the vertices that the targets of weights other than 0 move.

    Args:
        rest: (N, 3) vertices at rest.
        faces: (F, 3) triangles.
        targets: of the same vertices.

    Raises:
        ValueError: a target moves a vertex that is not there.
    """

    def __init__(self, rest: Floats, faces: Indices, targets: MorphTargets) -> None:
        if len(targets.vertices) and not (
            0 <= targets.vertices.min() <= targets.vertices.max() < len(rest)
        ):
            raise ValueError(f"Expected `targets` to move vertices in [0, {len(rest)})")
        self.targets = targets
        self._moved, slots = np.unique(targets.vertices, return_inverse=True)
        self._slots = slots.reshape(-1).astype(np.int64)
        around, corners = _triangles_around(self._moved, faces, len(rest))
        self._spans = np.zeros((len(self._moved), 4), dtype=np.int64)
        self._frames = np.zeros((len(self._moved), 9))
        _find_spans(rest, self._moved, around, corners, self._spans, self._frames)
        self._sums = np.zeros((len(self._moved), 3))
        self.add(np.zeros(len(targets)), np.array(rest, dtype=np.float64))  # compile now

    def add(self, weights: Floats, vertices: Floats) -> None:
        """Move vertices (N, 3) of the deformed surface in place.

        Args:
            weights: (T,) of each target.
            vertices: of the surface, deformed without any target.
        """
        targets = self.targets
        _sum_deltas(
            weights, targets.starts, self._slots, targets.deltas, self._sums, len(self._moved)
        )
        _turn(vertices, self._spans, self._frames, self._sums)
        _move(vertices, self._moved, self._sums)


def _triangles_around(moved: Indices, faces: Indices, count: int) -> tuple[Indices, Indices]:
    """Where the triangles of each moved vertex begin (D + 1,), and their other corners (A, 2)."""
    slot = np.full(count, -1, dtype=np.int64)
    slot[moved] = np.arange(len(moved))
    turns = [faces[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)]
    corners = np.concatenate(turns).astype(np.int64)
    own = slot[corners[:, 0]]
    corners, own = corners[own >= 0], own[own >= 0]
    order = np.argsort(own, kind="stable")
    corners, own = corners[order], own[order]
    begins = np.searchsorted(own, np.arange(len(moved)))
    kept = np.arange(len(own)) - begins[own] < MOST_AROUND
    around = np.searchsorted(own[kept], np.arange(len(moved) + 1))
    return around.astype(np.int64), np.ascontiguousarray(corners[kept][:, 1:])


@kernel
def _span(vertices: Floats, a: int, b: int) -> tuple[float, float, float]:
    """The vector from vertex b to vertex a."""
    x = vertices[a, 0] - vertices[b, 0]
    y = vertices[a, 1] - vertices[b, 1]
    z = vertices[a, 2] - vertices[b, 2]
    return x, y, z


@kernel
def _worth(rest: Floats, a: int, b: int, c: int, e: int, with_first: bool) -> float:
    """The squared length of the span from c to e, or of its cross product with that from a to b."""
    x, y, z = _span(rest, c, e)
    if with_first:
        p, q, r = _span(rest, a, b)
        x, y, z = q * z - r * y, r * x - p * z, p * y - q * x
    return float(x * x + y * y + z * z)


@kernel
def _centred(rest: Floats, v: int, c: int, e: int) -> float:
    """1 for a span from c to e with vertex v in its middle, 1/2 for one that ends there."""
    x, y, z = _span(rest, c, e)
    p, q, r = _span(rest, c, v)
    s, t, u = _span(rest, e, v)
    length = x * x + y * y + z * z
    off = (p + s) ** 2 + (q + t) ** 2 + (r + u) ** 2
    return float(length / (length + off)) if length > 0.0 else 0.0


@kernel
def _axes(vertices: Floats, a: int, b: int, c: int, e: int) -> Nine:
    """The axes of the orthonormal frame of the spans from b to a and e to c; 0 for no area."""
    x, y, z = _span(vertices, a, b)
    p, q, r = _span(vertices, c, e)
    nx, ny, nz = y * r - z * q, z * p - x * r, x * q - y * p
    across, along = nx * nx + ny * ny + nz * nz, x * x + y * y + z * z
    across = 1.0 / math.sqrt(across) if across > 0.0 else 0.0
    along = 1.0 / math.sqrt(along) if along > 0.0 else 0.0
    x, y, z = x * along, y * along, z * along
    nx, ny, nz = nx * across, ny * across, nz * across
    return x, y, z, ny * z - nz * y, nz * x - nx * z, nx * y - ny * x, nx, ny, nz


@kernel
def _find_spans(
    rest: Floats,
    moved: Indices,
    around: Indices,
    corners: Indices,
    spans: Indices,
    frames: Floats,
) -> None:
    """The two spans of each moved vertex, from vertex to vertex (D, 4), and their frame at rest.

    The first is the longest across its ring, the second the one that makes the largest area with
    it; spans that have the vertex in their middle count for more. The frame (D, 9) of a vertex
    without area around it is 0.
    """
    ring = np.empty(2 * MOST_AROUND + 1, dtype=np.int64)
    for d in range(len(moved)):
        count = 1
        ring[0] = moved[d]
        for a in range(around[d], around[d + 1]):
            ring[count], ring[count + 1] = corners[a]
            count += 2
        for second in range(2):
            largest = 0.0
            for i in range(count):
                for j in range(i):
                    size = _worth(rest, spans[d, 0], spans[d, 1], ring[i], ring[j], second == 1)
                    size *= _centred(rest, ring[0], ring[i], ring[j])
                    if size > largest:
                        largest = size
                        spans[d, 2 * second], spans[d, 2 * second + 1] = ring[i], ring[j]
        axes = _axes(rest, spans[d, 0], spans[d, 1], spans[d, 2], spans[d, 3])
        if axes[6] != 0.0 or axes[7] != 0.0 or axes[8] != 0.0:
            for k in range(9):
                frames[d, k] = axes[k]


@kernel
def _sum_deltas(
    weights: Floats, starts: Indices, slots: Indices, deltas: Floats, out: Floats, count: int
) -> None:
    """The weighted sum (D, 3) of the deltas of each moved vertex."""
    for d in range(count):
        for k in range(3):
            out[d, k] = 0.0
    for t in range(len(weights)):
        weight = weights[t]
        if weight != 0.0:
            for e in range(starts[t], starts[t + 1]):
                for k in range(3):
                    out[slots[e], k] += weight * deltas[e, k]


@kernel
def _turn(vertices: Floats, spans: Indices, frames: Floats, sums: Floats) -> None:
    """Turn each sum from the frame of its spans at rest to that on the deformed surface.

    Where there is no area, now or at rest, it is not turned.
    """
    for d in range(len(sums)):
        x, y, z = sums[d, 0], sums[d, 1], sums[d, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        u = frames[d, 0] * x + frames[d, 1] * y + frames[d, 2] * z
        v = frames[d, 3] * x + frames[d, 4] * y + frames[d, 5] * z
        w = frames[d, 6] * x + frames[d, 7] * y + frames[d, 8] * z
        a, b, c, e = spans[d, 0], spans[d, 1], spans[d, 2], spans[d, 3]
        tx, ty, tz, bx, by, bz, nx, ny, nz = _axes(vertices, a, b, c, e)
        is_frame = nx * nx + ny * ny + nz * nz > 0.5 and u * u + v * v + w * w > 0.0
        if is_frame:
            sums[d, 0] = tx * u + bx * v + nx * w
            sums[d, 1] = ty * u + by * v + ny * w
            sums[d, 2] = tz * u + bz * v + nz * w


@kernel
def _move(vertices: Floats, moved: Indices, sums: Floats) -> None:
    """Add the sums, after all frames were measured on the surface as it was deformed."""
    for d in range(len(moved)):
        for k in range(3):
            vertices[moved[d], k] += sums[d, k]
