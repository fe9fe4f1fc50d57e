"""Flattens triangles that fold over their neighbours in sharp bends of the shown surface.

In a sharp bend a few triangles may fold over their neighbours; even a minimum of the energy may
contain folds. The solver's state from frame to frame keeps them. In the shown surface, the corners
of a folded triangle move to the middle of their neighbours. If the triangle is still folded, the
vertices around it move as well.

Folds appear and vanish over many frames. So each frame tests one of four parts of the triangles,
and those known to be folded.

A triangle is folded when its normal points against its normal at rest, turned by the cells of its
corners; see `solvers.surface.surface_quality`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from solvers.deform.arap_cells import Cells
from solvers.kernels.compiled import kernel, parallel_kernel
from solvers.linear.laplacian import Floats, Ints

ROUNDS = 4  # of moving vertices to the middle of their neighbours between two tests
PARTS = 4
PASSES = 3  # flattening a triangle may fold its neighbours
REACHES = 3  # the moved region grows by a ring of vertices up to so many times

Bools = NDArray[np.bool_]
Indices = NDArray[np.int32]
Singles = NDArray[np.float32]


class Sheet(NamedTuple):
    """Triangles (F, 3), their normals at rest (F, 3), and the triangles at each of N vertices."""

    faces: Indices
    normals: Singles
    starts: Indices
    faces_at: Indices


class Moving(NamedTuple):
    """The moved vertices: (N,) whether each is moved, and (N,) a list with room for all."""

    is_member: Bools
    members: Ints


@dataclass(frozen=True, slots=True, eq=False)
class CreasesState:
    """Which triangles (F,) are known to be folded, and which part of them was tested last."""

    folded: Bools
    part: int


class Creases:
    """Flattens the folded triangles of one surface.

    Args:
        rest: (N, 3) at rest, in the solver's order.
        faces: (F, 3) in that order.
        cells: the cells of the surface, for each vertex's neighbours.
    """

    def __init__(self, rest: Floats, faces: Ints, cells: Cells) -> None:
        faces = faces[np.argsort(faces.min(axis=1), kind="stable")]  # in the order of their corners
        a, b, c = (rest[faces[:, corner]] for corner in range(3))
        corners = np.argsort(faces, axis=None, kind="stable")
        self._sheet = Sheet(
            faces.astype(np.int32),
            np.cross(b - a, c - a).astype(np.float32),
            np.searchsorted(faces.ravel()[corners], np.arange(len(rest) + 1)).astype(np.int32),
            (corners // 3).astype(np.int32),
        )
        self._cells = cells
        self._folded = np.zeros(len(faces), np.bool_)
        self._part = 0
        self._moving = Moving(np.zeros(len(rest), np.bool_), np.zeros(len(rest), np.int64))

    def snapshot(self) -> CreasesState:
        """Return which triangles are known to be folded."""
        return CreasesState(self._folded.copy(), self._part)

    def restore(self, state: CreasesState) -> None:
        """Go back to a snapshot of the same surface."""
        self._folded[:], self._part = state.folded, state.part

    def flatten_folds(self, x: Floats, R: Floats) -> int:
        """Flatten the folded triangles of x (N, 3), given the cells' rotations R (N, 9).

        Handles may move, too.

        Returns:
            The number of triangles known to be folded.
        """
        self._part = (self._part + 1) % PARTS
        _find_folded(x, self._sheet.faces, self._sheet.normals, R, self._part, self._folded)
        which = np.flatnonzero(self._folded)
        if len(which):
            _lay_flat(x, which, self._sheet, R, self._cells, self._moving)
        return len(which)


@kernel
def _is_folded(x: Floats, face: Indices, normal: Singles, R: Floats) -> bool:
    """Whether a triangle's normal points against its rest normal, turned by its corners' cells."""
    a, b, c = face[0], face[1], face[2]
    u0, u1, u2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    v0, v1, v2 = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    m0, m1, m2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
    along = 0.0
    for k in range(3):
        i = face[k]
        along += m0 * (R[i, 0] * normal[0] + R[i, 1] * normal[1] + R[i, 2] * normal[2])
        along += m1 * (R[i, 3] * normal[0] + R[i, 4] * normal[1] + R[i, 5] * normal[2])
        along += m2 * (R[i, 6] * normal[0] + R[i, 7] * normal[1] + R[i, 8] * normal[2])
    return along < 0.0


@parallel_kernel
def _find_folded(
    x: Floats, faces: Indices, normals: Singles, R: Floats, part: int, folded: Bools
) -> None:
    """Update `folded` (F,) for one part of the triangles and for those known to be folded."""
    for f in prange(len(faces)):
        if folded[f] or f % PARTS == part:
            folded[f] = _is_folded(x, faces[f], normals[f], R)


@kernel
def _lay_flat(
    x: Floats, which: Ints, sheet: Sheet, R: Floats, cells: Cells, moving: Moving
) -> None:
    """Flatten the triangles `which`, then their neighbours that folded because of that."""
    for _ in range(PASSES):
        count = _flatten(x, which, sheet, R, cells, moving)
        size = 0
        for m in range(count):
            i = moving.members[m]
            moving.is_member[i] = False
            size += sheet.starts[i + 1] - sheet.starts[i]
        beside = np.empty(size, np.int64)
        found = 0
        for m in range(count):
            i = moving.members[m]
            for h in range(sheet.starts[i], sheet.starts[i + 1]):
                f = sheet.faces_at[h]
                if _is_folded(x, sheet.faces[f], sheet.normals[f], R):
                    beside[found] = f
                    found += 1
        if found == 0:
            break
        which = beside[:found]


@kernel
def _flatten(x: Floats, which: Ints, sheet: Sheet, R: Floats, cells: Cells, moving: Moving) -> int:
    """Move the corners of folded faces, and rings around them, until none of the faces is folded.

    Returns:
        The number of moved vertices, which are the first of `moving.members`.
    """
    count = 0
    for f in which:
        for k in range(3):
            count = _take(np.int64(sheet.faces[f, k]), moving, count)
    for reach in range(REACHES):
        for _ in range(ROUNDS):
            for m in range(count):
                _to_middle(x, moving.members[m], cells)
        folded = False
        for f in which:
            folded = folded or _is_folded(x, sheet.faces[f], sheet.normals[f], R)
        if not folded or reach + 1 == REACHES:
            break
        inner = count
        for m in range(inner):
            i = moving.members[m]
            for h in range(np.int64(cells.starts[i]), np.int64(cells.starts[i + 1])):
                count = _take(np.int64(cells.neighbours[h]), moving, count)
    return count


@kernel
def _take(i: np.int64, moving: Moving, count: int) -> int:
    """Add vertex i to the moved vertices; return their new number."""
    if moving.is_member[i]:
        return count
    moving.is_member[i] = True
    moving.members[count] = i
    return count + 1


@kernel
def _to_middle(x: Floats, i: np.int64, cells: Cells) -> None:
    first, last = np.int64(cells.starts[i]), np.int64(cells.starts[i + 1])
    if first == last:
        return
    for axis in range(3):
        total = 0.0
        for h in range(first, last):
            total += x[np.int64(cells.neighbours[h]), axis]
        x[i, axis] = total / (last - first)
