"""Surfaces to be cut and joined, and what makes one whole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.editing.surface.sheet import Sheet

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
ROUNDING = 1e-10  # what lies in one plane does not cross


def tube(around: int = 16, along: int = 21, radius: float = 0.1, *, ends: bool = True) -> Sheet:
    """From z = 0 to 1, with a seam along y = 0, x > 0; copies are (row, column) of a grid."""
    turn = 2.0 * np.pi * np.arange(around + 1) / around
    z = np.linspace(0.0, 1.0, along)
    ring = np.stack([radius * np.cos(turn[:-1]), radius * np.sin(turn[:-1])], axis=1)
    grid = np.concatenate([np.tile(ring, (along, 1)), np.repeat(z, around)[:, None]], axis=1)
    vertices = np.concatenate([grid, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    row, column = np.divmod(np.arange(along * (around + 1)), around + 1)
    vertex = np.concatenate([row * around + column % around, [len(grid), len(grid) + 1]])
    corner = np.arange((along - 1) * (around + 1)).reshape(along - 1, -1)[:, :-1].ravel()
    up = corner + around + 1
    faces = [np.stack([corner, corner + 1, up + 1], 1), np.stack([corner, up + 1, up], 1)]
    first, last = np.arange(around), (along - 1) * (around + 1) + np.arange(around)
    if ends:
        low, high = np.full(around, len(vertex) - 2), np.full(around, len(vertex) - 1)
        faces += [np.stack([low, first + 1, first], 1), np.stack([high, last, last + 1], 1)]
    return Sheet(vertices, vertex, np.concatenate(faces))


def texture_of(sheet: Sheet, around: int = 16) -> Array:
    """(M, 2) how far round and along the tube each copy is, in [0, 1]."""
    column = np.arange(len(sheet.vertex)) % (around + 1) / around
    return np.stack([column, sheet.vertices[sheet.vertex, 2]], axis=1)


def torus(around: int = 24, across: int = 12) -> Sheet:
    """Round z, of radius 1, as thick as 0.6."""
    a, b = np.divmod(np.arange(around * across), across)
    big, small = 2.0 * np.pi * a / around, 2.0 * np.pi * b / across
    radius = 1.0 + 0.3 * np.cos(small)
    vertices = np.stack([radius * np.cos(big), radius * np.sin(big), 0.3 * np.sin(small)], 1)
    right, up = (a + 1) % around * across + b, a * across + (b + 1) % across
    both = (a + 1) % around * across + (b + 1) % across
    here = np.arange(len(a))
    faces = np.concatenate([np.stack([here, right, both], 1), np.stack([here, both, up], 1)])
    return Sheet(vertices, here, faces)


def placed(sheet: Sheet, shift: tuple[float, float, float], size: float = 1.0) -> Sheet:
    return Sheet(size * sheet.vertices + shift, sheet.vertex, sheet.faces)


def together(*sheets: Sheet) -> Sheet:
    """Several surfaces as one, each a piece of its own."""
    vertices = np.cumsum([0, *(len(each.vertices) for each in sheets)])
    copies = np.cumsum([0, *(len(each.vertex) for each in sheets)])
    return Sheet(
        np.concatenate([each.vertices for each in sheets]),
        np.concatenate([each.vertex + at for each, at in zip(sheets, vertices, strict=False)]),
        np.concatenate([each.faces + at for each, at in zip(sheets, copies, strict=False)]),
    )


def inside_out(sheet: Sheet) -> Sheet:
    return Sheet(sheet.vertices, sheet.vertex, sheet.faces[:, ::-1].copy())


def is_watertight(sheet: Sheet) -> bool:
    """Whether every edge is between two triangles that go along it in opposite directions."""
    triangles = sheet.triangles
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    name = np.array([len(sheet.vertices), 1])
    one, other = np.sort(edges @ name), np.sort(edges[:, ::-1] @ name)
    return bool((np.diff(one) > 0).all() and (one == other).all())


def volume(sheet: Sheet) -> float:
    a, b, c = sheet.vertices[sheet.triangles].transpose(1, 0, 2)
    return float((np.cross(a, b) * c).sum() / 6.0)


def crossing_pairs(sheet: Sheet, chosen: NDArray[np.bool_]) -> int:
    """How many edges of the chosen triangles go through a triangle of the surface.

    Every edge against every triangle without a common vertex, by the signs of volumes of
    tetrahedra: slow, and independent of what made the surface.
    """
    x, triangles = sheet.vertices, sheet.triangles
    edges = np.unique(np.sort(triangles[chosen][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0)
    low, high = x[triangles].min(axis=1), x[triangles].max(axis=1)
    found = 0
    for a, b in edges.tolist():
        near = (low <= np.maximum(x[a], x[b])).all(axis=1)
        near &= (high >= np.minimum(x[a], x[b])).all(axis=1)
        near &= ~np.isin(triangles, [a, b]).any(axis=1)
        p, q, r = x[triangles[near]].transpose(1, 0, 2)
        sides = [_six_volumes(x[a], x[b], *pair) for pair in ((p, q), (q, r), (r, p))]
        through = np.abs(np.sign(sides).sum(axis=0)) == 3
        area = np.linalg.norm(np.cross(q - p, r - p), axis=1)
        first, last = (_six_volumes(x[end], p, q, r) / area for end in (a, b))
        parted = (first * last < 0.0) & (np.minimum(np.abs(first), np.abs(last)) > ROUNDING)
        found += int((through & parted).sum())
    return found


def _six_volumes(a: Array, b: Array, c: Array, d: Array) -> Array:
    out: Array = (np.cross(b - a, c - a) * (d - a)).sum(axis=-1)
    return out
