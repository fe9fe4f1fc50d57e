"""Triangles are split along a blade; what is new is interpolated along the edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array, vstack

from solvers.editing.surface.blade import Blade
from solvers.editing.surface.sheet import Array, Flags, Indices, Sheet

SNAPPED = 0.25
"""A vertex that is nearer to the blade, in shares of an edge, is moved onto it: no slivers."""

_AT_SEAM = 0.05  # of those on a seam: what copies carry on its far side stays as it was

_STEPS = 60  # of halving, at most, to find where an edge crosses a blade that is not plane


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """A surface with edges along a blade.

    Attributes:
        sheet: the surface.
        of_vertices: (N', N), rows sum to 1.
        of_copies: (M', M), rows sum to 1.
        of_faces: (F',) the face that each is a piece of.
        label: (F',) the side of the blade, 1 or -1; 0 where the blade was not to cut.
    """

    sheet: Sheet
    of_vertices: csr_array
    of_copies: csr_array
    of_faces: Indices
    label: Indices


def split(sheet: Sheet, blade: Blade, chosen: Flags, snapped: float = SNAPPED) -> Split:
    """Split the chosen faces of a surface where a blade crosses them.

    Args:
        sheet: the surface.
        blade: what cuts.
        chosen: (F,) the faces to be cut, with all beside them that the blade crosses too.
        snapped: vertices nearer to the blade than this share of an edge are moved along it.
    """
    triangles = sheet.triangles
    side = levelled(blade.side(sheet.vertices))
    moves = _moves(sheet, blade, side, chosen, snapped)
    side[list(moves)] = 0.0
    corner = np.sign(side[triangles]).astype(np.int64)
    crossed = chosen & (corner.min(axis=1) < 0) & (corner.max(axis=1) > 0)
    rows = np.flatnonzero(crossed)
    edges, number = _crossed_edges(sheet.faces[rows], corner[rows])
    ends, of_edge = np.unique(np.sort(sheet.vertex[edges], axis=1), axis=0, return_inverse=True)
    of_edge = of_edge.reshape(-1)
    share = _shares(sheet.vertices, ends, blade)
    flipped = sheet.vertex[edges[:, 0]] != ends[of_edge, 0]
    along = np.where(flipped, 1.0 - share[of_edge], share[of_edge])
    of_vertices = _with_rows(_moved(len(sheet.vertices), moves), ends, share)
    of_copies = _with_rows(_moved(len(sheet.vertex), _of_copies(sheet, moves)), edges, along)
    vertex = np.concatenate([sheet.vertex, len(sheet.vertices) + of_edge])
    pieces, piece_of = _pieces(sheet.faces[rows], corner[rows], number + len(sheet.vertex))
    faces = np.concatenate([sheet.faces[~crossed], pieces])
    of_faces = np.concatenate([np.flatnonzero(~crossed), rows[piece_of]])
    above = np.concatenate([np.sign(side), np.zeros(len(ends))])[vertex[faces]]
    label = np.where(above.max(axis=1) > 0.0, 1, -1) * chosen[of_faces]
    vertices = np.asarray(of_vertices @ sheet.vertices)
    return Split(Sheet(vertices, vertex, faces), of_vertices, of_copies, of_faces, label)


def levelled(side: Array) -> Array:
    """Return signed distances (n,), with none where there is only rounding."""
    fine = 1e-9 * float(np.abs(side).max(initial=0.0))
    return np.where(np.abs(side) <= fine, 0.0, side)


def _crossed_edges(faces: Indices, corner: Indices) -> tuple[Indices, Indices]:
    """The crossed edges (E, 2) as pairs of copies, and the number of each face's sides (f, 3)."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    across = corner * np.roll(corner, -1, axis=1) < 0
    number = np.full(faces.shape, -1, dtype=np.int64)
    edges, found = np.unique(np.sort(sides[across], axis=1), axis=0, return_inverse=True)
    number[across] = found.reshape(-1)
    return edges.reshape(-1, 2), number


def _pieces(faces: Indices, corner: Indices, cuts: Indices) -> tuple[Indices, Indices]:
    """The pieces (p, 3) of crossed faces, and which face each is of (p,).

    Args:
        faces: (f, 3).
        corner: (f, 3) on which side of the blade each corner is: -1, 0, or 1.
        cuts: (f, 3) the copy at the crossing of the side that begins at each corner.
    """
    pieces, owner = [], []
    for k in range(3):
        a, b, c = np.roll(faces, -k, axis=1).T
        ab, bc, ca = np.roll(cuts, -k, axis=1).T
        at, before, after = np.roll(corner, -k, axis=1).T
        through = np.flatnonzero((at == 0) & (before * after < 0))
        alone = np.flatnonzero((at != 0) & (at * before < 0) & (at * after < 0))
        for rows, triples in (
            (through, ((a, b, bc), (a, bc, c))),
            (alone, ((a, ab, ca), (ab, b, c), (ab, c, ca))),
        ):
            pieces += [np.stack(triple, axis=1)[rows] for triple in triples]
            owner += [rows] * len(triples)
    return np.concatenate(pieces), np.concatenate(owner)


def _shares(vertices: Array, ends: Indices, blade: Blade) -> Array:
    """How far along each edge (E, 2) the blade crosses it (E,)."""
    first, last = vertices[ends[:, 0]], vertices[ends[:, 1]]
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    at_low, at_high = blade.side(first), blade.side(last)
    share = at_low / np.where(at_low == at_high, 1.0, at_low - at_high)
    fine = 1e-12 * float(np.abs(np.concatenate([at_low, at_high, [0.0]])).max())
    for _ in range(_STEPS):
        here = blade.side(first + share[:, None] * (last - first))
        if (np.abs(here) <= fine).all():
            break
        below = here * at_low > 0.0
        low, high = np.where(below, share, low), np.where(below, high, share)
        share = np.where(np.abs(here) <= fine, share, 0.5 * (low + high))
    return share


def _moves(
    sheet: Sheet, blade: Blade, side: Array, chosen: Flags, snapped: float
) -> dict[int, tuple[int, float]]:
    """The vertices to be moved onto the blade: towards which neighbour, and by what share.

    Those stay whose move would turn a triangle over or make it thin.
    """
    triangles = sheet.triangles
    near = triangles[chosen]
    sides = np.unique(
        np.sort(np.stack([near, np.roll(near, -1, axis=1)], axis=2).reshape(-1, 2), axis=1), axis=0
    )
    sides = sides[side[sides[:, 0]] * side[sides[:, 1]] < 0.0]
    share = _shares(sheet.vertices, sides, blade)
    whole = np.concatenate([sides, sides[:, ::-1]])
    reach = np.concatenate([share, 1.0 - share])
    copies = np.bincount(sheet.vertex, minlength=len(sheet.vertices))
    most = np.where(copies[whole[:, 0]] > 1, min(snapped, _AT_SEAM), snapped)
    fit = np.flatnonzero(reach < most)
    fit = fit[np.argsort(reach[fit], kind="stable")]
    around = _around(triangles, np.unique(whole[fit, 0]))
    vertices, level = sheet.vertices.copy(), side.copy()
    moves: dict[int, tuple[int, float]] = {}
    for row in fit.tolist():
        vertex, other = whole[row].tolist()
        if vertex in moves or other in moves:
            continue
        here = vertices[vertex].copy()
        before = triangles[around[vertex]]
        old = _normals(vertices, before)
        vertices[vertex] += reach[row] * (sheet.vertices[other] - here)
        level[vertex] = 0.0
        new = _normals(vertices, before)
        flat = (level[before] == 0.0).all(axis=1).any()
        if flat or ((old * new).sum(axis=1) < 0.25 * (old * old).sum(axis=1)).any():
            vertices[vertex], level[vertex] = here, side[vertex]
        else:
            moves[vertex] = (other, float(reach[row]))
    return moves


def _around(triangles: Indices, wanted: Indices) -> dict[int, Indices]:
    """The triangles at each of some vertices."""
    flat = triangles.reshape(-1)
    places = np.flatnonzero(np.isin(flat, wanted))
    order = np.argsort(flat[places], kind="stable")
    groups = np.split(places[order] // 3, np.flatnonzero(np.diff(flat[places][order])) + 1)
    return dict(zip(wanted.tolist(), groups, strict=True)) if len(wanted) else {}


def _normals(vertices: Array, triangles: Indices) -> Array:
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    normals: Array = np.cross(b - a, c - a)
    return normals


def _moved(count: int, moves: dict[int, tuple[int, float]]) -> csr_array:
    """The identity (count, count), but for rows that are moved towards others."""
    rows = np.array(list(moves), dtype=np.int64)
    others = np.array([other for other, _ in moves.values()], dtype=np.int64)
    share = np.array([part for _, part in moves.values()], dtype=np.float64)
    places = np.concatenate([rows, rows]), np.concatenate([others, rows])
    change = coo_array((np.concatenate([share, -share]), places), shape=(count, count))
    return csr_array(eye_array(count) + change)


def _of_copies(sheet: Sheet, moves: dict[int, tuple[int, float]]) -> dict[int, tuple[int, float]]:
    """The moves of copies: each towards one with which it shares a face."""
    wanted = np.full(len(sheet.vertices), -1, dtype=np.int64)
    wanted[list(moves)] = [other for other, _ in moves.values()]
    found = {}
    for k in range(3):
        for step in (1, 2):
            here, there = sheet.faces[:, k], sheet.faces[:, (k + step) % 3]
            hit = wanted[sheet.vertex[here]] == sheet.vertex[there]
            for copy, other in zip(here[hit].tolist(), there[hit].tolist(), strict=True):
                found[copy] = (other, moves[int(sheet.vertex[copy])][1])
    return found


def _with_rows(top: csr_array, ends: Indices, share: Array) -> csr_array:
    """A matrix with a row more for each edge (E, 2): the place a share (E,) along it."""
    rows = np.arange(len(ends))
    entries = np.concatenate([1.0 - share, share])
    places = np.concatenate([rows, rows]), np.concatenate([ends[:, 0], ends[:, 1]])
    new = coo_array((entries, places), shape=(len(ends), top.shape[1]))
    return csr_array(vstack([top, new]))
