"""Compiled kernels that bind points to a coarse surface and move them with it.

They serve `solvers.surface.embedding`. Every kernel returns the same bits for any number of
threads, because the points are independent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from solvers.deform.rotation_fit import LANES, SCRATCH, fit_rotations
from solvers.kernels.compiled import kernel, parallel_kernel

_TINY = 1e-300
_STEPS = 64  # from triangle to triangle, each nearer to the point
_BLOCK = 512  # points in one thread's unit of work
_R = 9 * LANES

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Counts = NDArray[np.uint32]

# Columns of a frame: rotation by rows, moved half-offset origin, rest position.
FRAME = 16
_MOVED = 9
_REST = 12


class Triangles(NamedTuple):
    """A surface with vertices (C, 3), faces (F, 3), and the faces at each vertex.

    The faces at vertex v are incident[first[v] : first[v + 1]].
    """

    vertices: Floats
    faces: Ints
    first: Ints
    incident: Ints


class Places(NamedTuple):
    """Points (N, 3), their triangles, coordinates (N, 3) there, and squared distances to them."""

    points: Floats
    triangle: Ints
    weights: Floats
    gap: Floats


class Rings(NamedTuple):
    """The neighbours of vertices at rest (C, 3), as compressed rows, and weighted edges (M, 3)."""

    rest: Floats
    first: Counts
    neighbours: Counts
    edges: Floats


@parallel_kernel
def bind_locally(surface: Triangles, start: Ints, places: Places) -> None:
    """Find each point's nearest triangle from neighbour to neighbour, while the distance falls.

    Args:
        surface: the surface to search.
        start: (N,) the vertex to start at; a negative one skips the point.
        places: points, with infinite gaps at first; the other fields are written.
    """
    for i in prange(len(start)):
        if start[i] < 0:
            continue
        _search_around(surface, start[i], places, i)
        for _ in range(_STEPS):
            here = places.triangle[i]
            for corner in range(3):
                _search_around(surface, surface.faces[here, corner], places, i)
            if places.triangle[i] == here:
                break


@kernel
def _search_around(surface: Triangles, vertex: int, places: Places, i: int) -> None:
    """Move point i to one of a vertex's triangles if that is nearer than its present one."""
    point, vertices = places.points[i], surface.vertices
    for slot in range(surface.first[vertex], surface.first[vertex + 1]):
        face = surface.incident[slot]
        a, b, c = surface.faces[face, 0], surface.faces[face, 1], surface.faces[face, 2]
        u, v, w = _barycentric(point, vertices[a], vertices[b], vertices[c])
        gap = 0.0
        for axis in range(3):
            place = u * vertices[a, axis] + v * vertices[b, axis] + w * vertices[c, axis]
            gap += (place - point[axis]) ** 2
        if gap < places.gap[i]:
            places.gap[i] = gap
            places.triangle[i] = face
            places.weights[i, 0], places.weights[i, 1], places.weights[i, 2] = u, v, w


@kernel
def _barycentric(  # noqa: PLR0911  # one return for each region
    p: Floats, a: Floats, b: Floats, c: Floats
) -> tuple[float, float, float]:
    """The barycentric coordinates of the point of triangle (a, b, c) nearest to p, by regions.

    Source: Ericson 2005, Real-time collision detection, section 5.1.5.
    """
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for axis in range(3):
        ab, ac = b[axis] - a[axis], c[axis] - a[axis]
        d1, d2 = d1 + ab * (p[axis] - a[axis]), d2 + ac * (p[axis] - a[axis])
        d3, d4 = d3 + ab * (p[axis] - b[axis]), d4 + ac * (p[axis] - b[axis])
        d5, d6 = d5 + ab * (p[axis] - c[axis]), d6 + ac * (p[axis] - c[axis])
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / max(d1 - d3, _TINY)
        return 1.0 - t, t, 0.0
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / max(d2 - d6, _TINY)
        return 1.0 - t, 0.0, t
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / max(d4 - d3 + d5 - d6, _TINY)
        return 0.0, 1.0 - t, t
    s = 1.0 / max(va + vb + vc, _TINY)
    return 1.0 - vb * s - vc * s, vb * s, vc * s


@parallel_kernel
def fit_frames(x: Floats, rings: Rings, frames: Floats) -> None:
    """Fit the rotation of the surface around each vertex x (C, 3), into frames (C, FRAME).

    Source: Sorkine and Alexa 2007, eqs. (5) and (6).
    """
    first, edges, rest = rings.first, rings.edges, rings.rest
    count = len(x)
    for block in prange((count + LANES - 1) // LANES):
        lanes = np.empty(SCRATCH)
        start = block * LANES
        size = min(LANES, count - start)
        for k in range(size):
            i = np.uint64(start + k)
            s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = 0.0
            for h in range(np.uint64(first[i]), np.uint64(first[i + np.uint64(1)])):
                j = np.uint64(rings.neighbours[h])
                d0, d1, d2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
                e0, e1, e2 = edges[h, 0], edges[h, 1], edges[h, 2]
                s0, s1, s2 = s0 + d0 * e0, s1 + d0 * e1, s2 + d0 * e2
                s3, s4, s5 = s3 + d1 * e0, s4 + d1 * e1, s5 + d1 * e2
                s6, s7, s8 = s6 + d2 * e0, s7 + d2 * e1, s8 + d2 * e2
            lanes[k], lanes[LANES + k], lanes[2 * LANES + k] = s0, s1, s2
            lanes[3 * LANES + k], lanes[4 * LANES + k], lanes[5 * LANES + k] = s3, s4, s5
            lanes[6 * LANES + k], lanes[7 * LANES + k], lanes[8 * LANES + k] = s6, s7, s8
        fit_rotations(lanes, size)
        for k in range(size):
            v = start + k
            for row in range(3):
                turned = 0.0
                for column in range(3):
                    r = lanes[_R + (3 * row + column) * LANES + k]
                    frames[v, 3 * row + column] = r
                    turned += r * rest[v, column]
                frames[v, _MOVED + row] = x[v, row] - 0.5 * turned
                frames[v, _REST + row] = rest[v, row]


@parallel_kernel
def follow_frames(
    frames: Floats,
    corners: NDArray[np.uint16],
    weights: Singles,
    details: Singles,
    out: Floats | Singles,
) -> None:
    """Move N points with the frames (C, FRAME) of their triangles' corners.

    With rest positions v_k, q = sum w_k v_k and detail d = p - q, a point moves to
    sum w_k (x_k + R_k ((q - v_k) / 2 + d)).

    Args:
        frames: of the surface's vertices.
        corners: (N, 3) each point's triangle.
        weights: (N, 2) of the second and third corner; all three sum to 1.
        details: (N, 3) from the point's place in its triangle to the point itself.
        out: (N, 3), float32 or float64.
    """
    count = len(corners)
    for block in prange((count + _BLOCK - 1) // _BLOCK):
        for n in range(block * _BLOCK, min((block + 1) * _BLOCK, count)):
            i = np.uint64(n)
            a, b, c = np.uint64(corners[i, 0]), np.uint64(corners[i, 1]), np.uint64(corners[i, 2])
            v, w = np.float64(weights[i, 0]), np.float64(weights[i, 1])
            u = 1.0 - v - w
            p0 = 0.5 * (u * frames[a, 12] + v * frames[b, 12] + w * frames[c, 12]) + details[i, 0]
            p1 = 0.5 * (u * frames[a, 13] + v * frames[b, 13] + w * frames[c, 13]) + details[i, 1]
            p2 = 0.5 * (u * frames[a, 14] + v * frames[b, 14] + w * frames[c, 14]) + details[i, 2]
            r0 = u * frames[a, 0] + v * frames[b, 0] + w * frames[c, 0]
            r1 = u * frames[a, 1] + v * frames[b, 1] + w * frames[c, 1]
            r2 = u * frames[a, 2] + v * frames[b, 2] + w * frames[c, 2]
            r3 = u * frames[a, 3] + v * frames[b, 3] + w * frames[c, 3]
            r4 = u * frames[a, 4] + v * frames[b, 4] + w * frames[c, 4]
            r5 = u * frames[a, 5] + v * frames[b, 5] + w * frames[c, 5]
            r6 = u * frames[a, 6] + v * frames[b, 6] + w * frames[c, 6]
            r7 = u * frames[a, 7] + v * frames[b, 7] + w * frames[c, 7]
            r8 = u * frames[a, 8] + v * frames[b, 8] + w * frames[c, 8]
            t0 = u * frames[a, 9] + v * frames[b, 9] + w * frames[c, 9]
            t1 = u * frames[a, 10] + v * frames[b, 10] + w * frames[c, 10]
            t2 = u * frames[a, 11] + v * frames[b, 11] + w * frames[c, 11]
            out[i, 0] = t0 + r0 * p0 + r1 * p1 + r2 * p2
            out[i, 1] = t1 + r3 * p0 + r4 * p1 + r5 * p2
            out[i, 2] = t2 + r6 * p0 + r7 * p1 + r8 * p2
