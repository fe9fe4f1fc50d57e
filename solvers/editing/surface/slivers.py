"""Takes short edges and slivers out of a piece of a surface, without moving what stays."""

from __future__ import annotations

import math

import numpy as np

from solvers.editing.surface.sheet import Flags, Indices, Sheet

SHORT = 0.45
"""Edges shorter than this share of the usual one collapse."""

_FLAT = 0.9  # cosine between two triangles whose edge may be flipped
_TURNED = 0.6  # cosine by which a triangle may turn when a corner of it moves
_LOST = 0.01  # of the usual edge cubed: what one collapse may take from a triangle's volume
_LONG = 2.0  # of the usual edge: no collapse makes a longer one
_PASSES = 4
_TINY = 1e-300

Point = tuple[float, float, float]


def without_slivers(sheet: Sheet, near: Flags) -> tuple[Indices, Indices]:
    """Collapse short edges and flip bad ones between near vertices.

    An edge on a seam only collapses along the seam, so that copies keep their sides.

    Args:
        sheet: a closed surface.
        near: (N,) vertices that may go.

    Returns:
        The faces (F', 3), into the same copies, and the row of each among the old ones (F',).
    """
    patch = _Patch(sheet, near)
    for _ in range(_PASSES):
        if patch.collapse() + patch.flip() == 0:
            break
    return patch.result()


class _Patch:
    """Faces near a seam, each with its three copies, and the faces at each vertex."""

    def __init__(self, sheet: Sheet, near: Flags) -> None:
        triangles = sheet.triangles
        touched = np.flatnonzero(near[triangles].any(axis=1))
        self._sheet, self._near = sheet, near
        self._vertex: list[int] = sheet.vertex.tolist()
        self._points: list[Point] = list(map(tuple, sheet.vertices.tolist()))
        self._faces: dict[int, list[int]] = dict(
            zip(touched.tolist(), sheet.faces[touched].tolist(), strict=True)
        )
        self._around: dict[int, set[int]] = {}
        for face, row in zip(touched.tolist(), triangles[touched].tolist(), strict=True):
            for vertex in row:
                self._around.setdefault(vertex, set()).add(face)
        at = sheet.vertices[triangles[touched]]
        self._edge = float(np.median(np.linalg.norm(at - np.roll(at, 1, axis=1), axis=2)))
        self._gone: list[int] = []

    def result(self) -> tuple[Indices, Indices]:
        faces = self._sheet.faces.copy()
        rows = np.array(list(self._faces), dtype=np.int64)
        faces[rows] = np.array(list(self._faces.values()), dtype=np.int64).reshape(-1, 3)
        kept = np.ones(len(faces), dtype=np.bool_)
        kept[self._gone] = False
        return faces[kept], np.flatnonzero(kept)

    def collapse(self) -> int:
        """Collapse short edges, the shortest first; return how many."""
        done = 0
        short = [edge for edge in self._edges() if self._length(*edge) < SHORT * self._edge]
        for edge in sorted(short, key=lambda edge: self._length(*edge)):
            for a, b in (edge, edge[::-1]):
                if self._near[a] and self._may_collapse(a, b):
                    self._merge(a, b)
                    done += 1
                    break
        return done

    def flip(self) -> int:
        """Flip edges where that makes the smaller angle larger; return how many."""
        return sum(self._flipped(a, b) for a, b in self._edges())

    def _edges(self) -> list[tuple[int, int]]:
        found = set()
        for copies in self._faces.values():
            row = [self._vertex[copy] for copy in copies]
            for a, b in zip(row, (*row[1:], row[0]), strict=True):
                if self._near[a] and self._near[b]:
                    found.add((min(a, b), max(a, b)))
        return sorted(found)

    def _row(self, face: int) -> list[int]:
        return [self._vertex[copy] for copy in self._faces[face]]

    def _length(self, a: int, b: int) -> float:
        return math.dist(self._points[a], self._points[b])

    def _ring(self, vertex: int) -> set[int]:
        return {each for face in self._around[vertex] for each in self._row(face)} - {vertex}

    def _copies(self, a: int, b: int) -> dict[int, int] | None:
        """The copy of b for each copy of a, or None where a has one without."""
        pairs: dict[int, int] = {}
        wanted = set()
        for face in self._around[a]:
            row, copies = self._row(face), self._faces[face]
            wanted.add(copies[row.index(a)])
            if b in row:
                pairs[copies[row.index(a)]] = copies[row.index(b)]
        return pairs if wanted == set(pairs) else None

    def _may_collapse(self, a: int, b: int) -> bool:
        if a not in self._around or b not in self._around:
            return False
        shared = self._around[a] & self._around[b]
        if len(shared) != 2 or len(self._ring(a) & self._ring(b)) != 2:
            return False
        if self._copies(a, b) is None:
            return False
        rest = self._around[a] - shared
        rows = [self._row(face) for face in rest]
        if not rows:
            return False
        return all(
            self._may_move([self._points[v] for v in row], row.index(a), self._points[b])
            for row in rows
        )

    def _may_move(self, corners: list[Point], which: int, to: Point) -> bool:
        """Whether a triangle stays sound when one of its corners moves."""
        n, size, square = _measured(*corners)
        if abs(_dot(n, _minus(to, corners[which]))) > _LOST * self._edge**3:
            return False
        corners[which] = to
        m, new_size, new_square = _measured(*corners)
        if size > 0.02 * square and _dot(n, m) < _TURNED * size * new_size:
            return False  # where it is thinner, its normal is noise
        if new_size < 0.05 * new_square and new_size * square < size * new_square:
            return False
        return not (new_square > (_LONG * self._edge) ** 2 and new_square > square)

    def _merge(self, a: int, b: int) -> None:
        pairs = self._copies(a, b)
        assert pairs is not None
        for face in self._around.pop(a):
            row = self._row(face)
            if b in row:
                for vertex in row:
                    if vertex != a:
                        self._around[vertex].discard(face)
                del self._faces[face]
                self._gone.append(face)
            else:
                self._faces[face] = [pairs.get(copy, copy) for copy in self._faces[face]]
                self._around[b].add(face)

    def _flipped(self, a: int, b: int) -> bool:
        shared = self._around.get(a, set()) & self._around.get(b, set())
        if len(shared) != 2:
            return False
        one, other = sorted(shared)
        rows, copies = [self._row(one), self._row(other)], [self._faces[one], self._faces[other]]
        starts = [row.index(next(v for v in row if v not in (a, b))) for row in rows]
        (c, p, q), (d, r, s) = (row[at:] + row[:at] for row, at in zip(rows, starts, strict=True))
        left, right = (row[at:] + row[:at] for row, at in zip(copies, starts, strict=True))
        if (p, q) != (s, r) or left[1] != right[2] or left[2] != right[1]:
            return False
        # What else c and d share is only known where one of them is near.
        known = c if self._near[c] else d
        if not self._near[known] or {c, d} <= {known, *self._ring(known)}:
            return False
        if not _is_better_flipped(*(self._points[vertex] for vertex in (c, p, q, d))):
            return False
        self._faces[one], self._faces[other] = (
            [left[0], left[1], right[0]],
            [right[0], right[1], left[0]],
        )
        self._around[q].discard(one)
        self._around[p].discard(other)
        self._around[d].add(one)
        self._around[c].add(other)
        return True


def _is_better_flipped(c: Point, p: Point, q: Point, d: Point) -> bool:
    """Whether the flat triangles c p q and d q p are worse than c p d and d q c."""
    n, first, first_square = _measured(c, p, q)
    m, second, second_square = _measured(d, q, p)
    i, third, third_square = _measured(c, p, d)
    j, fourth, fourth_square = _measured(d, q, c)
    before = min(first / max(first_square, _TINY), second / max(second_square, _TINY))
    after = min(third / max(third_square, _TINY), fourth / max(fourth_square, _TINY))
    is_flat = _dot(n, m) >= _FLAT * first * second and _dot(i, j) >= _FLAT * third * fourth
    is_outward = min(_dot(i, n) + _dot(i, m), _dot(j, n) + _dot(j, m)) > 0.0
    return after > 1.02 * before and is_flat and is_outward


def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _measured(a: Point, b: Point, c: Point) -> tuple[Point, float, float]:
    """The normal of a triangle, its length, and the square of the longest side."""
    ab, ac, bc = _minus(b, a), _minus(c, a), _minus(c, b)
    normal = _cross(ab, ac)
    return normal, math.sqrt(_dot(normal, normal)), max(_dot(ab, ab), _dot(ac, ac), _dot(bc, bc))
