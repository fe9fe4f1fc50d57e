"""Skin weights from heat that the bones of a skeleton give to the surface around them.

Source: Baran and Popovic 2007, Automatic rigging and animation of 3D characters, section 4. Each
vertex takes heat from the nearest bone that it sees inside the body, the more the nearer the bone
is, and heat spreads along the surface. Where the parts of the body are known, nearness is measured
in their radii (not in the paper), or a thick trunk would lose its flanks to the beginnings of thin
limbs, which lie inside it. The share of a bone in a vertex is its temperature when that
bone alone is hot. The heat of an arm cannot jump to the belly beside it, nor that of a bone which
sticks out of the surface: it lies in front of the skin that it could heat.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from solvers.kernels.compiled import kernel
from solvers.linear.block_factor import BlockFactor
from solvers.linear.laplacian import Floats, Ints, cotangent_laplacian, weighted_sums
from solvers.linear.nested_dissection import dissect
from solvers.surface.sightlines import ROOM, BoxTree, box_tree, is_blocked
from solvers.surface.skin_weights import INFLUENCES, Skin, skin_of_weights

_TIE = 1e-4  # relative difference of distance between bones that share a vertex
_TRIED = 16  # nearest bones that a vertex looks for
_CLOSEST = 1e-3  # of the character's size: a bone on the surface is taken to be this far away
_SEEN = 0.6  # least share of a part's vertices that see a bone, or all are taken to see theirs
_SMALL = 0.25  # of the character's size: such a part that sees no bone is moved by one


_BENT = 0.03  # of the size: how far rigid weights are spread
_WHOLE = 0.999  # a weight that is the whole
_GRAZES = 0.2  # sine of the angle to the surface: a line at less may leave the body, not enter it


@dataclass(frozen=True, slots=True, eq=False)
class _Bones:
    """B bones from node to node.

    Attributes:
        starts, ends: (B, 3) positions of their ends.
        owners: (B,) the node with which each turns: the one at which it starts.
        radii: (B,) in which the distances to it are measured.
    """

    starts: Floats
    ends: Floats
    owners: Ints
    radii: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """The bones that N vertices see.

    Attributes:
        bones: (N, INFLUENCES) the nearest bones that each vertex sees, equally near, -1 for none.
        distances: (N,) to them, infinite for none.
        nearest: (N,) the nearest bone, seen or not.
        nearest_distances: (N,) to it.
    """

    bones: Ints
    distances: Floats
    nearest: Ints
    nearest_distances: Floats


def skin_of_heat(
    vertices: Floats,
    faces: Ints,
    parents: Ints,
    positions: Floats,
    radii: Floats | None = None,
) -> Skin:
    """Return the skin by which a surface follows the nodes of the skeleton within it.

    A bone belongs to the node at which it starts, whose rotation turns what lies beyond. A small
    part of the surface that sees no bone follows the nearest one rigidly.

    Args:
        vertices: (N, 3) rest positions, finite.
        faces: (F, 3) triangles, any: boundaries, non-manifold edges, several parts.
        parents: (K,) parent of each node, -1 at the root.
        positions: (K, 3) rest positions of the nodes.
        radii: (K,) how thick the body is around the bone that ends at each node, in any unit; None
            where this is unknown: equally thick.
    """
    bones = _bones_of(parents, positions, np.ones(len(parents)) if radii is None else radii)
    owners, owner_of = np.unique(bones.owners, return_inverse=True)
    if len(owners) == 1:
        return Skin(np.full((len(vertices), 1), owners[0]), np.ones((len(vertices), 1)))
    extent = float(np.ptp(vertices, axis=0).max()) or 1.0
    points = np.ascontiguousarray(vertices / extent)
    part_of = _parts(faces, len(points))
    scaled = replace(bones, starts=bones.starts / extent, ends=bones.ends / extent)
    sight = _look(points, faces, part_of, scaled)
    heat, bone_of = _heat(points, faces, part_of, sight)
    sources = np.zeros((len(points), len(owners)))
    hot = bone_of >= 0
    vertex, _ = np.nonzero(hot)
    shares = heat / np.maximum(hot.sum(axis=1), 1)
    np.add.at(sources, (vertex, owner_of[bone_of[hot]]), shares[vertex])
    matrix = sp.csr_matrix(cotangent_laplacian(points, faces) + sp.diags(heat))
    weights = np.maximum(_spread(matrix, points, sources), 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    nodes = np.broadcast_to(owners, weights.shape)
    return Skin(nodes, weights).strongest(INFLUENCES)


def skin_of_rigid_weights(vertices: Floats, faces: Ints, weights: sp.csr_array) -> Skin:
    """Return a skin that bends where neighbouring vertices follow different nodes.

    Files and wooden figures give each vertex to one node; where their surface goes on from one to
    the next, it would tear. The weights are spread by heat over a share of the size, so that parts
    which are apart stay rigid.

    Args:
        vertices: (N, 3) at rest.
        faces: (F, 3).
        weights: (N, K), one node a vertex.
    """
    used, column = np.unique(weights.tocoo().col, return_inverse=True)
    entries = weights.tocoo()
    given = np.zeros((len(vertices), len(used)))
    given[entries.row, column] = entries.data
    extent = max(float(np.ptp(vertices, axis=0).max()), 1e-30)
    points = vertices / extent
    areas = np.maximum(_areas(points, faces), 1e-12)
    matrix = sp.csr_matrix(sp.diags(areas) + _BENT**2 * cotangent_laplacian(points, faces))
    spread = np.maximum(_spread(matrix, points, areas[:, None] * given), 0.0)
    return skin_of_weights(_on_nodes(spread, used, weights.shape[1]))


def is_rigid(weights: sp.csr_array) -> bool:
    """Whether each vertex follows one node alone, by weights (N, K)."""
    return bool(len(weights.data)) and weights.nnz == weights.shape[0] == np.count_nonzero(
        weights.data > _WHOLE
    )


def _on_nodes(spread: Floats, used: Ints, count: int) -> sp.csr_array:
    """Weights of the used nodes (N, U) as weights of all (N, count), without the tiny ones."""
    row, column = np.nonzero(spread > 1.0 - _WHOLE)
    return sp.csr_array((spread[row, column], (row, used[column])), shape=(len(spread), count))


def _bones_of(parents: Ints, positions: Floats, radii: Floats) -> _Bones:
    """The bones of a tree; the root alone where there is none of any length."""
    ends = np.flatnonzero(parents >= 0)
    starts = parents[ends]
    long = np.linalg.norm(positions[ends] - positions[starts], axis=1) > 0.0
    ends, starts = ends[long], starts[long]
    if not len(ends):
        ends = starts = np.flatnonzero(parents < 0)
    return _Bones(positions[starts], positions[ends], starts.astype(np.int64), radii[ends])


def _parts(faces: Ints, count: int) -> Ints:
    """The connected part of the surface that each vertex belongs to, (N,)."""
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    graph = sp.coo_matrix((np.ones(len(tails)), (tails, heads)), shape=(count, count))
    part_of: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return part_of


def _heat(points: Floats, faces: Ints, part_of: Ints, sight: _Sight) -> tuple[Floats, Ints]:
    """How strongly bones heat each vertex (N,), and which, (N, INFLUENCES) or -1 for none."""
    bones = sight.bones.copy()
    parts = int(part_of.max()) + 1
    sees = bones[:, 0] >= 0
    blind = np.bincount(part_of, sees, parts) < _SEEN * np.bincount(part_of, minlength=parts)
    unseen = blind[part_of]
    bones[unseen] = -1
    bones[unseen, 0] = sight.nearest[unseen]
    distances = np.where(unseen, sight.nearest_distances, sight.distances)
    heat = _areas(points, faces) / np.maximum(distances, _CLOSEST) ** 2
    heat[bones[:, 0] < 0] = 0.0
    cold = ~(np.bincount(part_of, heat, parts) > 0.0)
    for part in np.flatnonzero(blind | cold):
        own = np.flatnonzero(part_of == part)
        extent = float(np.ptp(points[own], axis=0).max())
        if cold[part] or extent < _SMALL:
            bones[own] = -1
            bones[own, 0] = np.bincount(sight.nearest[own]).argmax()
            heat[own] = 1.0
    return heat, bones


def _areas(points: Floats, faces: Ints) -> Floats:
    """A third of the area around each vertex, (N,)."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    thirds = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return weighted_sums(faces.ravel(), np.repeat(thirds, 3), len(points))


def _look(points: Floats, faces: Ints, part_of: Ints, bones: _Bones) -> _Sight:
    """Look from every vertex for the bones nearest to it."""
    count = len(points)
    seen = np.full((count, INFLUENCES), -1, dtype=np.int64)
    nearest = np.empty(count, dtype=np.int64)
    far = np.full((count, 2), np.inf)
    outward = _outward(points, faces, part_of)
    places = bones.starts, bones.ends, bones.radii
    _find_bones(box_tree(points, faces), part_of, outward, places, seen, nearest, far)
    return _Sight(seen, far[:, 0], nearest, far[:, 1])


def _outward(points: Floats, faces: Ints, part_of: Ints) -> Floats:
    """The unit normals (N, 3) of closed parts, outward; zero on a part that has no inside."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    across = np.cross(b - a, c - a)
    normals = np.stack(
        [weighted_sums(faces.ravel(), np.repeat(own, 3), len(points)) for own in across.T], axis=1
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    parts = int(part_of.max()) + 1
    volumes = np.bincount(part_of[faces[:, 0]], np.einsum("fi,fi->f", a, across), parts)
    edges = np.stack([faces.ravel(), np.roll(faces, -1, axis=1).ravel()], axis=1)
    key, back = edges @ (len(points), 1), edges[:, ::-1] @ (len(points), 1)
    alone = np.bincount(part_of[edges[~np.isin(key, back), 0]], minlength=parts) > 0
    normals *= np.where(alone, 0.0, np.sign(volumes))[part_of][:, None]
    return normals


@kernel
def _find_bones(
    tree: BoxTree,
    part_of: Ints,
    outward: Floats,
    bones: tuple[Floats, Floats, Floats],
    seen: Ints,
    nearest: Ints,
    far: Floats,
) -> None:
    """Fill in a `_Sight`; far (N, 2) are the distances to seen bones and to the nearest."""
    starts, ends, radii = bones
    points = np.empty((len(starts), 3))
    squared = np.empty(len(starts))
    waiting = np.empty(ROOM, dtype=np.int64)
    for v in range(len(seen)):
        x = (tree.vertices[v, 0], tree.vertices[v, 1], tree.vertices[v, 2])
        for b in range(len(starts)):
            squared[b] = _nearest_point(x, starts[b], ends[b], points[b]) / (radii[b] * radii[b])
        best = _least(squared)
        nearest[v], far[v, 1] = best, radii[best] * math.sqrt(squared[best])
        most, found = np.inf, 0
        for _ in range(min(_TRIED, len(starts))):
            b = _least(squared)
            d2 = squared[b]
            if d2 > most or found == seen.shape[1]:
                break
            squared[b] = np.inf
            ahead = 0.0
            for axis in range(3):
                ahead += outward[v, axis] * (points[b, axis] - x[axis])
            if ahead != 0.0 and ahead > -_GRAZES * radii[b] * math.sqrt(d2):
                continue
            if not is_blocked(tree, part_of, v, points[b], waiting):
                if found == 0:
                    far[v, 0] = radii[b] * math.sqrt(d2)
                    most = d2 * (1.0 + _TIE) ** 2
                seen[v, found] = b
                found += 1


@kernel
def _nearest_point(x: tuple[float, float, float], a: Floats, b: Floats, out: Floats) -> float:
    """Put the point of the segment from a to b (3,) that is nearest to x into out (3,).

    Returns:
        The squared distance.
    """
    d0, d1, d2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length2 = max(d0 * d0 + d1 * d1 + d2 * d2, 1e-300)
    t = ((x[0] - a[0]) * d0 + (x[1] - a[1]) * d1 + (x[2] - a[2]) * d2) / length2
    t = min(max(t, 0.0), 1.0)
    squared = 0.0
    out[0], out[1], out[2] = a[0] + t * d0, a[1] + t * d1, a[2] + t * d2
    for axis in range(3):
        squared += (x[axis] - out[axis]) ** 2
    return squared


@kernel
def _least(values: Floats) -> int:
    """The index of the least value."""
    best = 0
    for b in range(1, len(values)):
        if values[b] < values[best]:
            best = b
    return best


def _spread(matrix: sp.csr_matrix, points: Floats, sources: Floats) -> Floats:
    """Solve for the columns of `sources` (N, B), three at a time."""
    tree = dissect(matrix, points)
    order = tree.order
    factor = BlockFactor(sp.csr_matrix(matrix[order][:, order]), tree)
    found = np.empty_like(sources)
    x = np.empty((len(points), 3))
    b = np.zeros((len(points), 3))
    for first in range(0, sources.shape[1], 3):
        last = min(first + 3, sources.shape[1])
        b[:] = 0.0
        b[:, : last - first] = sources[order, first:last]
        factor.solve(b, x)
        found[order, first:last] = x[:, : last - first]
    return found
