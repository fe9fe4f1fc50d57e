"""The seam of a union: slivers go, the crease is smoothed, and what is carried blends across it."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from solvers.editing.surface.compacting import compact
from solvers.editing.surface.self_crossing import crosses_itself
from solvers.editing.surface.sheet import Array, Derived, Flags, Indices, Sheet
from solvers.editing.surface.slivers import without_slivers

_RINGS = 3  # of neighbours on each side of the seam that are made even
_SMOOTHINGS = 4  # of the crease, each half-way to the mean of the neighbours
_BLENDS = 6  # of what vertices carry


def evened(whole: Derived, at_seam: Flags) -> Derived:
    """Make the seam of a union even and smooth, as far as it then does not cross itself.

    The crease where both surfaces meet is hollow, and is filled; edges that stand out stay sharp.

    Args:
        whole: the union.
        at_seam: (N,) the vertices where both surfaces meet.
    """
    near = _grown(whole.sheet.triangles, at_seam, _RINGS)
    faces, kept = without_slivers(whole.sheet, near)
    even = Sheet(whole.sheet.vertices, whole.sheet.vertex, faces)
    seam = at_seam & np.isin(np.arange(len(near)), even.triangles)
    near = _grown(even.triangles, seam, _RINGS)
    average = _average(even.triangles, len(near))
    inner = _grown(even.triangles, seam, 1)
    smooth = even.vertices
    for _ in range(_SMOOTHINGS):
        smooth = _filled(smooth, even.triangles, average, inner)
    rows = kept
    sheet = even if _crosses(smooth, faces, near, whole.sheet) else _at(smooth, even)
    if sheet is even and _crosses(even.vertices, faces, near, whole.sheet):
        sheet, rows = whole.sheet, np.arange(len(whole.sheet.faces))
    return compact(
        Derived(
            sheet,
            _blended(whole.of_vertices, _average(sheet.triangles, len(near)), near),
            whole.of_copies,
            whole.of_faces[rows],
            near,
        )
    )


def _filled(vertices: Array, triangles: Indices, average: csr_array, inner: Flags) -> Array:
    """Vertices drawn half-way to the mean of their neighbours where that is outward: a fillet."""
    corners = vertices[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, triangles[:, k], across)
    step = average @ vertices - vertices
    outward = inner & ((step * normals).sum(axis=1) > 0.0)
    filled: Array = np.where(outward[:, None], vertices + 0.5 * step, vertices)
    return filled


def _at(vertices: Array, sheet: Sheet) -> Sheet:
    return Sheet(vertices, sheet.vertex, sheet.faces)


def _crosses(vertices: Array, faces: Indices, near: Flags, sheet: Sheet) -> bool:
    triangles = sheet.vertex[faces]
    chosen: Flags = np.asarray(near[triangles].any(axis=1), dtype=np.bool_)
    return crosses_itself(vertices, triangles, chosen)


def _grown(triangles: Indices, chosen: Flags, rings: int) -> Flags:
    """The chosen vertices (N,) and their neighbours, so many rings of them."""
    grown = chosen.copy()
    for _ in range(rings):
        grown[triangles[grown[triangles].any(axis=1)]] = True
    return grown


def _average(triangles: Indices, count: int) -> csr_array:
    """(N, N): each row the mean over a vertex's neighbours; itself where it has none."""
    heads = triangles[:, [0, 1, 2]].ravel()
    tails = triangles[:, [1, 2, 0]].ravel()
    rows, columns = np.concatenate([heads, tails]), np.concatenate([tails, heads])
    links = csr_array(coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count)))
    links.data[:] = 1.0
    total = links.sum(axis=1)
    alone = diags_array((total == 0.0).astype(np.float64))
    return csr_array(diags_array(1.0 / np.maximum(total, 1.0)) @ links + alone)


def _blended(rows: csr_array, average: csr_array, near: Flags) -> csr_array:
    """What vertices are made of, each near the seam drawn to the mean of its neighbours."""
    share = 0.5 * near.astype(np.float64)
    mix = csr_array(diags_array(1.0 - share) + diags_array(share) @ average)
    for _ in range(_BLENDS):
        rows = csr_array(mix @ rows)
    return rows
