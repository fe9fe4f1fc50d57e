"""Builds the closed surfaces of a mesh whose volumes squash and stretch keeps."""

from __future__ import annotations

import numpy as np

from solvers.deform.volume_kernels import ClosedShells
from solvers.linear.laplacian import Floats, Ints

_CHUNK = 512  # faces in one partial sum


def build_shells(vertices: Floats, faces: Ints, part_of: Ints) -> ClosedShells:
    """Return the closed surfaces of a mesh (N, 3), (F, 3) with components (N,) of its vertices."""
    count = len(vertices)
    proper = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    fans = _fans(proper, part_of)
    whole = np.concatenate([proper, fans])
    a, b, c = (vertices[whole[:, corner]] for corner in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    areas[len(proper) :] = 0.0
    order = np.argsort(part_of[whole[:, 0]], kind="stable")
    whole, areas = whole[order], areas[order]
    chunks, parts = _chunks(part_of[whole[:, 0]])
    first_of = np.searchsorted(parts, parts)  # each component's first chunk
    corners, pairs = _around(proper, count)
    return ClosedShells(
        faces=whole.astype(np.uint32),
        areas=areas,
        chunks=chunks,
        parts=parts,
        origins=whole[chunks[first_of], 0].astype(np.uint32),
        corners=corners.astype(np.uint32),
        pairs=pairs.astype(np.uint32),
    )


def _fans(faces: Ints, part_of: Ints) -> Ints:
    """Triangles (B, 3) that close the holes of each component from one vertex on its boundary.

    One vertex serves all holes of a component: a cone over a closed loop closes it from anywhere.
    """
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = len(part_of)
    back = np.sort(heads * count + tails)
    sides = tails * count + heads
    is_open = back[np.searchsorted(back[:-1], sides)] != sides  # greater than all: the last
    tails, heads = tails[is_open], heads[is_open]
    centre_of = np.full(count, -1, dtype=np.int64)
    centre_of[part_of[tails[::-1]]] = tails[::-1]
    fans = np.stack([heads, tails, centre_of[part_of[tails]]], axis=1)
    proper: Ints = fans[(fans != np.roll(fans, 1, axis=1)).all(axis=1)]
    return proper


def _chunks(part_of_face: Ints) -> tuple[Ints, Ints]:
    """The first faces of chunks of at most `_CHUNK` faces of one component, and the components."""
    count = len(part_of_face)
    if not count:
        return np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    begins = np.flatnonzero(np.r_[True, part_of_face[1:] != part_of_face[:-1]])
    ends = np.r_[begins[1:], count]
    starts = np.concatenate([np.arange(b, e, _CHUNK) for b, e in zip(begins, ends, strict=True)])
    return np.r_[starts, count].astype(np.int64), part_of_face[starts]


def _around(faces: Ints, count: int) -> tuple[Ints, Ints]:
    """The first corner of each vertex (N + 1,), and each corner's other two vertices (3 F, 2)."""
    own = faces.T.ravel()
    others = np.concatenate([np.roll(faces, -1 - c, axis=1)[:, :2] for c in range(3)])
    order = np.argsort(own, kind="stable")
    return np.searchsorted(own[order], np.arange(count + 1)), others[order]
