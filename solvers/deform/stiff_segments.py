"""Cuts a surface along its skeleton into stiff segments, such as upper and lower arms.

Each limb is cut at nodes of its skeleton where it turns most, but never so closely that two joints
leave nothing stiff between them. A curve skeleton has a node about every radius, a rig one at each
anatomical joint; both give upper and lower arms. The inner ends of limbs
(`solvers.skeleton.limbs.bones_in_trunk`) and the forks where they meet are one segment, the trunk.

A segment is rigid except near its borders, where rigidity falls to zero within a limb's radius
along the surface. `solvers.arap.ArapSolver.stiffen` takes the segments.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import KDTree

from solvers.skeleton.limbs import closest_bones, limbs
from solvers.surface.edges import Edges

SEGMENT = 2.5  # the least length of a segment, in radii of its limb
JOINT = 1.0  # how far to each side of a border a surface bends, in radii of the thinner side
CROWD = 0.1  # [rad] the value of a joint where a limb is straight
STOUT = 0.6  # of the thickest part's radius: a thinner part is a limb, not a body
DETOUR = 2.0  # a path along edges may be so many times as long as a straight line
FAR = 2.2  # radii of a limb from its first bones: a vertex farther away belongs to the trunk
FRAGMENT = 0.1  # of its region, the least area of a piece of surface that is kept as its own

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class StiffSegments:
    """The segments of a surface of N vertices.

    Attributes:
        region_of: (N,) int, 0 to G - 1, the segment of each vertex.
        rigidity: (N,) in [0, 1]: 1 within a segment, 0 at its borders.
    """

    region_of: Indices
    rigidity: Array


def find_stiff_segments(
    vertices: Array,
    faces: Indices,
    parents: Indices,
    positions: Array,
    inside: NDArray[np.bool_],
    bone_of_vertex: Indices | None = None,
) -> StiffSegments:
    """Cut a surface into segments along its skeleton.

    Args:
        vertices: (N, 3) [m] rest positions.
        faces: (F, 3) triangles.
        parents: (K,) parent of each node, -1 at the root.
        positions: (K, 3) [m] rest positions of the nodes.
        inside: (K,) whether the bone that ends at each node lies inside the trunk.
        bone_of_vertex: (N,) the node at the far end of the bone that each vertex belongs to; the
            nearest bone when None.
    """
    bones, distance = closest_bones(vertices, parents, positions)
    if bone_of_vertex is not None:
        bones = bone_of_vertex
    segments = _segments(parents, positions, inside, bones, distance)
    region_of = segments.region_of_bone[bones]
    apart = distance > FAR * segments.radius[region_of]
    region_of = np.where(apart, segments.trunk_at[region_of], region_of)
    graph = _edge_graph(vertices, faces)
    region_of = _without_fragments(region_of, graph, vertices, faces)
    rigidity = _rigidity(region_of, segments.radius, graph, vertices)
    _, region_of = np.unique(region_of, return_inverse=True)
    return StiffSegments(region_of.astype(np.int64), rigidity)


class _Segments(NamedTuple):
    """G regions of a skeleton.

    `region_of_bone` (K,) is the region of the bone that ends at each node, `radius` (G,) each
    region's radius, and `trunk_at` (G,) the region of vertices too far from the limb's bones.
    """

    region_of_bone: Indices
    radius: Array
    trunk_at: Indices


def _segments(
    parents: Indices,
    positions: Array,
    inside: NDArray[np.bool_],
    bones: Indices,
    distance: Array,
) -> _Segments:
    children = np.bincount(parents[parents >= 0], minlength=len(parents))
    root = int(np.flatnonzero(parents < 0)[0])
    chains = limbs(parents)
    radii = [_median(distance[np.isin(bones, chain[1:])], distance) for chain in chains]
    thick = max([_median(distance[inside[bones]], np.zeros(1)), *radii], default=0.0)
    # A fork's region has the number of the fork; the numbers of segments follow.
    region_of_bone = np.full(len(parents), root, dtype=np.int64)
    radius_of = [thick] * len(parents)
    trunk_of = np.arange(len(parents))
    trunk_at = list(range(len(parents)))
    for chain, radius in zip(chains, radii, strict=True):
        start = 0
        while children[chain[0]] > 1 and start + 2 < len(chain) and inside[chain[start + 1]]:
            start += 1
        region_of_bone[chain[1 : start + 1]] = chain[0]
        outer = chain[start:]
        if children[chain[-1]] > 1 and _is_trunk(positions[outer], radius, thick):
            region_of_bone[outer[1:]] = chain[0]
            trunk_of[trunk_of == trunk_of[chain[-1]]] = trunk_of[chain[0]]
            continue
        cuts = [0, *_joints(positions[outer], radius), len(outer) - 1]
        for number, (first, last) in enumerate(itertools.pairwise(cuts)):
            region_of_bone[outer[first + 1 : last + 1]] = len(radius_of)
            is_first = number == 0 and children[chain[0]] > 1
            trunk_at.append(chain[0] if is_first else len(radius_of))
            radius_of.append(radius)
    whole = np.append(trunk_of, np.arange(len(parents), len(radius_of)))
    return _Segments(whole[region_of_bone], np.array(radius_of), whole[trunk_at])


def _median(values: Array, otherwise: Array) -> float:
    return float(np.median(values if len(values) else otherwise))


def _is_trunk(points: Array, radius: float, thick: float) -> bool:
    """Whether a polyline (n, 3) between two forks is as thick and as short as a body."""
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return length < SEGMENT * radius * (2.0 if radius > STOUT * thick else 1.0)


def _joints(points: Array, radius: float) -> list[int]:
    """The inner points of a polyline (n, 3) that are joints: those with the largest sum of turns.

    Two joints, and a joint and an end, are at least `SEGMENT` radii apart.
    """
    count = len(points)
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    least = SEGMENT * radius
    worth = np.full(count, -np.inf)
    before = np.zeros(count, dtype=np.int64)
    worth[0] = 0.0
    turns = _turns(points, along, radius)
    for node in range(1, count):
        ahead = np.flatnonzero(along[:node] <= along[node] - least)
        if len(ahead):
            before[node] = ahead[np.argmax(worth[ahead])]
            worth[node] = worth[before[node]] + turns[node] + CROWD
    joints = []
    node = int(before[-1])
    while node > 0:
        joints.append(node)
        node = int(before[node])
    return joints[::-1]


def _turns(points: Array, along: Array, radius: float) -> Array:
    """The turn [rad] of a polyline within a radius of each of its points (n,)."""

    def at(places: Array) -> Array:
        return np.stack([np.interp(places, along, points[:, axis]) for axis in range(3)], axis=1)

    incoming, outgoing = points - at(along - radius), at(along + radius) - points
    sine = np.linalg.norm(np.cross(incoming, outgoing), axis=1)
    angles: Array = np.arctan2(sine, np.einsum("ij,ij->i", incoming, outgoing))
    return angles


def _edge_graph(vertices: Array, faces: Indices) -> csr_array:
    edges, count = Edges.of(vertices, faces), len(vertices)
    rows, columns = np.concatenate([edges.ends, edges.ends[:, ::-1]]).T
    return coo_array((np.tile(edges.lengths, 2), (rows, columns)), shape=(count, count)).tocsr()


def _without_fragments(
    region_of: Indices, graph: csr_array, vertices: Array, faces: Indices
) -> Indices:
    """Move small pieces of a region, apart from its rest, to the regions around them."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    areas = np.bincount(faces.ravel(), np.repeat(area, 3), minlength=len(vertices))
    region_of = region_of.copy()
    for _ in range(3):  # a fragment may lie within a fragment
        tails, heads = graph.nonzero()
        same = region_of[tails] == region_of[heads]
        within = coo_array((same[same], (tails[same], heads[same])), shape=graph.shape)
        number, piece_of = connected_components(within, directed=False)
        size = np.bincount(piece_of, areas, minlength=number)
        whole = np.bincount(region_of, areas)
        region_of_piece = np.zeros(number, dtype=np.int64)
        region_of_piece[piece_of] = region_of
        small = size < FRAGMENT * whole[region_of_piece]
        crossing = small[piece_of[tails]] & ~same & ~small[piece_of[heads]]
        if not crossing.any():
            break
        # Each small piece joins the region to which most of its edges lead.
        most = int(region_of.max()) + 1
        keys, votes = np.unique(
            piece_of[tails[crossing]] * most + region_of[heads[crossing]], return_counts=True
        )
        order = np.lexsort((-votes, keys // most))
        pieces, first = np.unique(keys[order] // most, return_index=True)
        region_of_piece[pieces] = keys[order][first] % most
        region_of = region_of_piece[piece_of]
    return region_of


def _rigidity(region_of: Indices, radii: Array, graph: csr_array, vertices: Array) -> Array:
    """The rigidity of each vertex by its distance to the borders, in radii of the thinner side."""
    tails, heads = graph.nonzero()
    crossing = region_of[tails] != region_of[heads]
    tails, heads = tails[crossing], heads[crossing]
    reach = JOINT * np.minimum(radii[region_of[tails]], radii[region_of[heads]])
    share = np.ones(len(region_of))
    for radius in np.unique(reach):
        border = np.unique(tails[reach == radius])
        far = dijkstra(graph, directed=False, indices=border, min_only=True, limit=DETOUR * radius)
        near = np.flatnonzero(np.isfinite(far))
        gap = KDTree(vertices[border]).query(vertices[near])[0]
        share[near] = np.minimum(share[near], gap / max(radius, 1e-300))
    smooth: Array = share * share * (3.0 - 2.0 * share)
    return smooth
