"""Extracts a skeleton from any surface: a tree of nodes along the middle of its limbs.

The nodes come from local separators of the surface's edge graph. A local separator is a small set
of vertices whose removal cuts a piece of the surface in two, such as a ring around an arm. Broken
surfaces are closed and dense ones reduced first. The resulting graph is opened at its loops,
extended to the tips of the limbs, pruned of spurs, merged at crowded forks, smoothed and evenly
resampled, so that every limb is one chain of similar bones.

Source: Bærentzen and Rotenberg 2021, "Skeletonization via Local Separators", ACM TOG 40(5), as
implemented by PyGEL3D. The steps from its graph to a tree are our own.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import breadth_first_order
from scipy.spatial import cKDTree

from solvers.retarget.abstraction import find_root
from solvers.skeleton.curve_tree import (
    resampled,
    smoothed,
    with_merged_forks,
    with_tips,
    without_loops,
    without_spurs,
)
from solvers.skeleton.local_separators import local_separators
from solvers.skeleton.space_graph import (
    FloatArray,
    IntArray,
    SpaceGraph,
    border_edges,
    edge_matrix,
    has_inside,
    reduced,
    surface_graph,
    welded,
)
from solvers.skeleton.tree import Tree
from solvers.surface.voxel_solid import surface_samples, voxel_solid

VERSION = 4
"""Part of a cache's key: raise it whenever the same surface gives another skeleton."""

# Lengths are shares of the longest side of the surface's box.
_MOST_ENDS = 66  # so that MOST_NODES suffice for the bones of every limb
_FEWEST = 24  # fewer vertices form no rings around limbs
_FLAT = 1e-3  # a thinner surface is a sheet
_SPACING = 1 / 64  # of the samples on the border of a sheet
_SHORTEST = 0.04  # the least length of a limb
_STRAIGHT_BONES = 4


def extract_skeleton(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, FloatArray]:
    """Return a tree of nodes inside the surface: parents (K,), -1 for the root, positions (K, 3).

    The surface may be closed, open, flat, broken or non-manifold, and may have several components.
    The same arrays always give the same tree, of 2 to `curve_tree.MOST_NODES` nodes. Every parent
    comes before its children.

    Args:
        vertices: (N, 3), any unit and frame; vertices without a face have no effect.
        faces: (F, 3) into `vertices`.

    Raises:
        ValueError: there is no face, or a vertex that is used is not finite.
        ImportError: PyGEL3D or fast_simplification is not installed.

    Source: Bærentzen and Rotenberg 2021, sections 3 and 4; the root is AniMesh's, section 4.1.
    """
    used, compact = np.unique(faces, return_inverse=True)
    points = np.asarray(vertices, dtype=np.float64)[used]
    if len(points) == 0 or not np.isfinite(points).all():
        raise ValueError("Expected `faces` not to be empty and `vertices` to be finite")
    scale = float(np.abs(points).max()) or 1.0
    points = points / scale
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    size = float((high - low).max()) or 1.0
    points = (points - middle) / size
    tree = _limbs(*welded(points, compact.reshape(-1, 3)))
    parents, positions = _rooted(tree or _principal_axis(points))
    return parents, (positions * size + middle) * scale


def _limbs(points: FloatArray, triangles: IntArray) -> SpaceGraph | None:
    """The clean tree of a surface, or None for a surface without limbs."""
    if len(points) < _FEWEST:
        return None
    border = border_edges(triangles)
    flat = np.ptp(points @ _axes(points)[2]) < _FLAT
    if flat and len(border):
        outside = cKDTree(
            surface_samples(points, np.column_stack([border, border[:, 0]]), _SPACING)
        )
    else:
        solid = voxel_solid(points, triangles)
        outside = cKDTree(solid.outermost)
        if not flat and not has_inside(points, triangles, border):
            points, triangles = solid.closed_surface()
    surface = surface_graph(*reduced(points, triangles))
    tree = without_loops(*local_separators(surface), outside)
    tree = without_spurs(tree, surface, outside, _SHORTEST)
    tree = with_merged_forks(tree, outside)
    shortest = _SHORTEST
    while len((tree := without_spurs(tree, surface, outside, shortest)).ends()) > _MOST_ENDS:
        shortest *= 1.5
    if len(tree.positions) < 2:
        return None
    tree = resampled(smoothed(with_tips(tree, surface)))
    longest = np.ptp(tree.positions, axis=0).max()
    return tree if longest >= 0.25 * np.ptp(points, axis=0).max() else None


def _axes(points: FloatArray) -> FloatArray:
    """The principal axes of the points, the longest first, as rows."""
    centred = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(centred.T @ centred)[1].T[::-1])


def _principal_axis(points: FloatArray) -> SpaceGraph:
    """A straight chain along the longest axis of a surface without limbs, within its box."""
    axis = _axes(points)[0]
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    middle = points.mean(axis=0)
    along = (points - middle) @ axis
    box = np.stack([points.min(axis=0), points.max(axis=0)]) - middle
    walls = np.sort(box[:, axis != 0.0] / axis[axis != 0.0], axis=0)
    first, last = max(along.min(), walls[0].max()), min(along.max(), walls[1].min())
    positions = middle + np.linspace(first, last, _STRAIGHT_BONES + 1)[:, None] * axis
    edges = np.stack([np.arange(_STRAIGHT_BONES), np.arange(1, _STRAIGHT_BONES + 1)], axis=1)
    return SpaceGraph(positions, edges.astype(np.int64))


def _rooted(tree: SpaceGraph) -> tuple[IntArray, FloatArray]:
    """Parents and positions from the root of AniMesh's hierarchy, parents before children."""
    parents, positions = _ordered(tree, 0)
    root = find_root(Tree(parents, positions))[0]
    return _ordered(tree, int(np.flatnonzero((tree.positions == positions[root]).all(axis=1))[0]))


def _ordered(tree: SpaceGraph, root: int) -> tuple[IntArray, FloatArray]:
    """Parents and positions of the nodes in breadth-first order from `root`."""
    count = len(tree.positions)
    links = edge_matrix(count, tree.edges, np.ones(len(tree.edges)))
    order, before = breadth_first_order(links, root, directed=False)
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    parents = np.where(order == root, -1, place[np.maximum(before[order], 0)])
    return parents.astype(np.int64), tree.positions[order]
