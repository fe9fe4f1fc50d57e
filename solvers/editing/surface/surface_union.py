"""Two closed surfaces become one: their boolean union, with its seam made even and smooth."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array

from solvers.editing.surface.seam import evened
from solvers.editing.surface.sheet import Array, Derived, Indices, Sheet

_NONE = 1e-6  # a smaller share of a corner is none: the vertex is on the edge, or at a corner


def united(base: Sheet, graft: Sheet) -> Derived:
    """Unite two closed surfaces that overlap; what is inside the other goes.

         _____                  _____
        |   __|__              |     \\__
        |  |  |  |     ->      |        |
        |__|__|  |             |_____   |
           |_____|                   |__|

    What the new surface is made of counts on from the base to the graft: `of_vertices` is (N', N of
    the base + N of the graft), and so are `of_copies` and `of_faces`. At the seam, vertices are
    made of both, and blend within a few edges. Slivers there are collapsed, edges flipped, and the
    crease smoothed, unless the surface would then cross itself. The rest stays as it is.

    Args:
        base, graft: closed, in the same frame.

    Raises:
        ValueError: one of them is not closed, or they do not meet; in one line.
        ImportError: the optional library manifold3d is missing.

    Source: Borosan et al. 2012, RigMesh, section on merging, for what a seam is to be; the union is
    manifold3d's.
    """
    from manifold3d import Manifold  # noqa: PLC0415  # an optional extra

    first = int(Manifold.reserve_ids(2))
    solids = []
    for number, (sheet, name) in enumerate(((base, "base"), (graft, "graft"))):
        solids.append(_solid(sheet, first + number, name))
    whole = (solids[0] + solids[1]).to_mesh64()
    starts: Indices = np.asarray(whole.run_index, dtype=np.int64) // 3
    run: Indices = np.asarray(whole.run_original_id, dtype=np.int64) - first
    of_graft = np.repeat(run, starts[1:] - starts[:-1])
    triangles = np.asarray(whole.tri_verts, dtype=np.int64)
    if set(np.unique(of_graft).tolist()) != {0, 1}:
        raise ValueError("one part is all inside the other; move the graft out of it")
    both = _together(base, graft)
    of_faces = np.asarray(whole.face_id, dtype=np.int64) + of_graft * len(base.faces)
    vertices = np.asarray(whole.vert_properties, dtype=np.float64)[:, :3]
    merge = np.arange(len(vertices))
    merge[np.asarray(whole.merge_from_vert, dtype=np.int64)] = np.asarray(
        whole.merge_to_vert, dtype=np.int64
    )
    used, place = np.unique(merge[triangles], return_inverse=True)
    vertices, triangles = vertices[used], place.reshape(-1, 3)
    at_seam = np.zeros(len(vertices), dtype=np.int64)
    for number in (0, 1):
        at_seam[np.unique(triangles[of_graft == number])] += 1
    if not (at_seam == 2).any():
        raise ValueError("the parts do not meet; move the graft into the base")
    return evened(_derived(both, vertices, triangles, of_faces), at_seam == 2)


def _solid(sheet: Sheet, number: int, name: str) -> Any:
    from manifold3d import Error, Manifold, Mesh64  # noqa: PLC0415  # an optional extra

    triangles = sheet.triangles
    mesh = Mesh64(
        np.ascontiguousarray(sheet.vertices, dtype=np.float64),
        np.ascontiguousarray(triangles, dtype=np.uint64),
        run_index=np.array([0, triangles.size], dtype=np.uint64),
        run_original_id=np.array([number], dtype=np.uint32),
        face_id=np.arange(len(triangles), dtype=np.uint64),
    )
    solid = Manifold(mesh)
    if solid.status() != Error.NoError or solid.is_empty():
        raise ValueError(
            f"the {name} is no closed surface ({solid.status().name}); close its openings first"
        )
    return solid


def _together(base: Sheet, graft: Sheet) -> Sheet:
    return Sheet(
        np.concatenate([base.vertices, graft.vertices]),
        np.concatenate([base.vertex, graft.vertex + len(base.vertices)]),
        np.concatenate([base.faces, graft.faces + len(base.vertex)]),
    )


def _derived(both: Sheet, vertices: Array, triangles: Indices, of_faces: Indices) -> Derived:
    """The union with what its vertices and copies are made of, by where they are in their faces."""
    source = both.faces[of_faces]
    shares = _shares(both.vertices[both.vertex[source]], vertices[triangles])
    corners = np.repeat(source, 3, axis=0)
    flat = shares.reshape(-1, 3)
    # One copy for each vertex and each set of copies between which it lies.
    support = np.sort(np.where(flat > 0.0, corners, -1), axis=1)
    keys = np.concatenate([triangles.reshape(-1, 1), support], axis=1)
    wanted, one, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rows = np.repeat(np.arange(len(one)), 3)
    of_copies = csr_array(
        coo_array(
            (flat[one].ravel(), (rows, corners[one].ravel())), shape=(len(one), len(both.vertex))
        )
    )
    vertex = wanted[:, 0]
    share = 1.0 / np.bincount(vertex, minlength=len(vertices))
    mean = coo_array(
        (share[vertex], (vertex, np.arange(len(vertex)))), shape=(len(vertices), len(vertex))
    )
    welds = coo_array(
        (np.ones(len(both.vertex)), (np.arange(len(both.vertex)), both.vertex)),
        shape=(len(both.vertex), len(both.vertices)),
    )
    of_vertices = csr_array(csr_array(mean) @ of_copies @ csr_array(welds))
    of_vertices.eliminate_zeros()
    of_copies.eliminate_zeros()
    sheet = Sheet(vertices, vertex, index.reshape(-1, 3).astype(np.int64))
    none = np.zeros(len(vertices), dtype=np.bool_)
    return Derived(sheet, of_vertices, of_copies, of_faces, none)


def _shares(source: Array, corners: Array) -> Array:
    """Barycentric coordinates (F, 3, 3) of three corners each (F, 3, 3) in triangles (F, 3, 3)."""
    a, b, c = source.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    square = np.maximum((normal**2).sum(axis=1), 1e-300)
    shares = np.empty_like(corners)
    for k in range(3):
        p = corners[:, k]
        shares[:, k, 1] = (np.cross(p - a, c - a) * normal).sum(axis=1) / square
        shares[:, k, 2] = (np.cross(b - a, p - a) * normal).sum(axis=1) / square
        shares[:, k, 0] = 1.0 - shares[:, k, 1] - shares[:, k, 2]
    shares[shares < _NONE] = 0.0
    normed: Array = shares / shares.sum(axis=2, keepdims=True)
    return normed
