"""Which straight lines a surface blocks, by a tree of boxes around its triangles.

The triangles are put in the order of their centres along a Morton curve and paired up into a full
binary tree of boxes (Lauterbach et al. 2009, Fast BVH construction on GPUs, section 3, with a fixed
number of triangles a leaf).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.linear.laplacian import Floats, Ints

_LEAF = 4  # triangles
ROOM = 64  # boxes that may wait at any time: more than the tree is deep
_NEAR = 1e-3  # of a line: a triangle this near to its end does not block it
_GRID = 1023  # cells along an axis of the Morton curve


class BoxTree(NamedTuple):
    """The triangles of a surface, in a binary tree of boxes.

    Attributes:
        vertices: (N, 3).
        faces: (F, 3) in the order of the leaves.
        low, high: (2 L, 3) corners of the boxes: box 1 is the root, boxes 2 b and 2 b + 1 are the
            children of box b, and the leaf L + l has the triangles from 4 l on.
    """

    vertices: Floats
    faces: Ints
    low: Floats
    high: Floats


def box_tree(vertices: Floats, faces: Ints) -> BoxTree:
    """Return the tree of the triangles `faces` (F, 3) between `vertices` (N, 3)."""
    corners = vertices[faces]  # (F, 3, 3)
    order = (
        np.argsort(_morton(corners.mean(axis=1)), kind="stable") if len(faces) else np.zeros(0, int)
    )
    leaves = 1
    while leaves * _LEAF < len(faces):
        leaves *= 2
    low, high = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    leaf = leaves + np.arange(len(faces)) // _LEAF
    np.minimum.at(low, leaf, corners[order].min(axis=1))
    np.maximum.at(high, leaf, corners[order].max(axis=1))
    first = leaves
    while first > 1:
        pairs = slice(first, 2 * first)
        low[first // 2 : first] = low[pairs].reshape(-1, 2, 3).min(axis=1)
        high[first // 2 : first] = high[pairs].reshape(-1, 2, 3).max(axis=1)
        first //= 2
    return BoxTree(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces[order], dtype=np.int64),
        low,
        high,
    )


def _morton(points: Floats) -> NDArray[np.int64]:
    """The place of points (n, 3) along a Morton curve."""
    low = points.min(axis=0)
    size = max(float((points.max(axis=0) - low).max()), 1e-300)
    cells = ((points - low) / size * _GRID).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


@kernel
def is_blocked(tree: BoxTree, part_of: Ints, vertex: int, end: Floats, waiting: Ints) -> bool:
    """Whether the vertex's own part of the surface crosses the line from a vertex to an end (3,).

    Triangles at the vertex itself do not count, nor do those that touch the far end.

    Args:
        tree: the triangles.
        part_of: (N,) the part of each vertex.
        vertex: where the line begins.
        end: (3,) where it ends.
        waiting: room for the boxes still to be looked into, (ROOM,).
    """
    o0, o1, o2 = tree.vertices[vertex, 0], tree.vertices[vertex, 1], tree.vertices[vertex, 2]
    d0, d1, d2 = end[0] - o0, end[1] - o1, end[2] - o2
    leaves = len(tree.low) // 2
    waiting[0] = 1
    count = 1
    while count > 0:
        count -= 1
        box = waiting[count]
        if not _meets(tree.low[box], tree.high[box], (o0, o1, o2), (d0, d1, d2)):
            continue
        if box < leaves:
            waiting[count], waiting[count + 1] = 2 * box, 2 * box + 1
            count += 2
            continue
        first = (box - leaves) * _LEAF
        for f in range(first, min(first + _LEAF, len(tree.faces))):
            a, b, c = tree.faces[f, 0], tree.faces[f, 1], tree.faces[f, 2]
            if vertex in (a, b, c) or part_of[a] != part_of[vertex]:
                continue
            if _crosses(tree.vertices, a, b, c, (o0, o1, o2), (d0, d1, d2)):
                return True
    return False


@kernel
def _meets(
    low: Floats, high: Floats, o: tuple[float, float, float], d: tuple[float, float, float]
) -> bool:
    """Whether the line o + t d, t in [0, 1], meets a box; a box without triangles is never met."""
    if low[0] > high[0]:
        return False
    near, far = 0.0, 1.0
    for axis in range(3):
        if d[axis] == 0.0:
            if o[axis] < low[axis] or o[axis] > high[axis]:
                return False
            continue
        t0, t1 = (low[axis] - o[axis]) / d[axis], (high[axis] - o[axis]) / d[axis]
        near = max(near, min(t0, t1))
        far = min(far, max(t0, t1))
    return near <= far * (1.0 + 1e-12) + 1e-12


@kernel
def _crosses(
    vertices: Floats,
    a: int,
    b: int,
    c: int,
    o: tuple[float, float, float],
    d: tuple[float, float, float],
) -> bool:
    """Whether the line o + t d crosses a triangle well within its ends.

    Source: Moeller and Trumbore 1997, Fast, minimum storage ray/triangle intersection.
    """
    a0, a1, a2 = vertices[a, 0], vertices[a, 1], vertices[a, 2]
    u0, u1, u2 = vertices[b, 0] - a0, vertices[b, 1] - a1, vertices[b, 2] - a2
    v0, v1, v2 = vertices[c, 0] - a0, vertices[c, 1] - a1, vertices[c, 2] - a2
    p0, p1, p2 = d[1] * v2 - d[2] * v1, d[2] * v0 - d[0] * v2, d[0] * v1 - d[1] * v0
    determinant = u0 * p0 + u1 * p1 + u2 * p2
    if determinant == 0.0:
        return False
    s0, s1, s2 = o[0] - a0, o[1] - a1, o[2] - a2
    along_u = (s0 * p0 + s1 * p1 + s2 * p2) / determinant
    if not 0.0 <= along_u <= 1.0:
        return False
    q0, q1, q2 = s1 * u2 - s2 * u1, s2 * u0 - s0 * u2, s0 * u1 - s1 * u0
    along_v = (d[0] * q0 + d[1] * q1 + d[2] * q2) / determinant
    if not (along_v >= 0.0 and along_u + along_v <= 1.0):
        return False
    t = (v0 * q0 + v1 * q1 + v2 * q2) / determinant
    return bool(_NEAR < t < 1.0 - _NEAR)
