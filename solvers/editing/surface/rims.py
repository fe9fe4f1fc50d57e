"""The rims that a cut leaves: where the two sides of a blade meet, as closed rings of edges."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from solvers.editing.surface.sheet import Array, Flags, Indices
from solvers.editing.surface.splitting import Split

ABOVE, BELOW = 1, -1


def rims(split: Split) -> list[Indices]:
    """Return the closed rings of vertices (n,) between both sides, in the direction of those above.

    What begins or ends at a border of an open surface is no ring, and is left out.

    Raises:
        ValueError: more than two triangles meet at an edge of the rim, or two rims at a vertex, or
            triangles there turn both ways.
    """
    edges, face, name = _edges(split.sheet.triangles)
    label = split.label[face]
    shared = np.intersect1d(name[label == ABOVE], name[label == BELOW])
    at_rim = np.isin(name, shared)
    _, counts = np.unique(name[at_rim], return_counts=True)
    if (counts != 2).any():
        raise ValueError(
            "more than two triangles share an edge where it is cut; mend it or cut elsewhere"
        )
    above = edges[at_rim & (label == ABOVE)]
    below = edges[at_rim & (label == BELOW)]
    outs, ins = (np.bincount(above[:, k], minlength=len(split.sheet.vertices)) for k in (0, 1))
    width = np.array([len(outs), 1])
    paired = np.array_equal(np.sort(above @ width), np.sort(below[:, ::-1] @ width))
    if not paired or (np.abs(outs - ins) > 1).any():
        raise ValueError("triangles are turned inside out where it is cut; mend it first")
    if max(outs.max(), ins.max()) > 1:
        raise ValueError("two rims would touch where it is cut; cut a little beside it")
    following = dict(above.tolist())
    rings = []
    for start in above[np.isin(above[:, 0], above[:, 1], invert=True), 0].tolist():
        at = start
        while at in following:
            at = following.pop(at)
    while following:
        start, at = next(iter(following.items()))
        ring = [start]
        while at != start:
            ring.append(at)
            at = following[at]
        for at in ring:
            del following[at]
        rings.append(np.array(ring, dtype=np.int64))
    return rings


def sides(split: Split) -> Flags:
    """Return which faces (F,) come off: all that hang together with those above the blade.

    Pieces of their own that the blade did not cut go with what is nearest to them.

    Raises:
        ValueError: the surface still hangs together.
    """
    triangles, vertices = split.sheet.triangles, split.sheet.vertices
    piece = _pieces(triangles, split.label)
    count = int(piece.max(initial=-1)) + 1
    above = np.bincount(piece[split.label == ABOVE], minlength=count) > 0
    below = np.bincount(piece[split.label == BELOW], minlength=count) > 0
    if (above & below).any():
        raise ValueError("the surface hangs together round the cut; cut its other holds first")
    if not above.any() or not below.any():
        raise ValueError("the cut takes nothing off; nothing is on one side of it")
    off = above[piece]
    loose = ~(above | below)[piece]
    if loose.any():
        known = np.flatnonzero(~loose)
        middles = vertices[triangles].mean(axis=1)
        nearest = known[KDTree(middles[known]).query(middles[loose])[1]]
        votes = np.zeros(count)
        np.add.at(votes, piece[loose], np.where(off[nearest], 1.0, -1.0))
        off[loose] = votes[piece[loose]] > 0.0
    return off


def _edges(triangles: Indices) -> tuple[Indices, Indices, Indices]:
    """The sides (3F, 2) of triangles, the triangle of each, and a number for both directions."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    face = np.tile(np.arange(len(triangles)), 3)
    low, high = edges.min(axis=1), edges.max(axis=1)
    return edges, face, low * (int(high.max(initial=0)) + 1) + high


def _pieces(triangles: Indices, label: Indices) -> Indices:
    """The number (F,) of the piece that each triangle is in, parted at the rims."""
    _, face, name = _edges(triangles)
    order = np.lexsort((label[face], name))
    face, name = face[order], name[order]
    joined = (name[1:] == name[:-1]) & (label[face[1:]] * label[face[:-1]] != -1)
    links = coo_array(
        (np.ones(int(joined.sum())), (face[1:][joined], face[:-1][joined])),
        shape=(len(triangles), len(triangles)),
    )
    found: Indices = connected_components(links, directed=False)[1].astype(np.int64)
    return found


def rim_edge(vertices: Array, split: Split, ring: Indices) -> float:
    """Return the mean length of the edges of the triangles at a ring: what a cap's should be."""
    at_ring = np.isin(split.sheet.triangles, ring).any(axis=1) & (split.label != 0)
    corners = vertices[split.sheet.triangles[at_ring]]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return float(np.median(sides))
