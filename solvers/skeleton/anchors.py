"""Binds a surface to a skeleton by anchors on the bones, each with a ring of handles.

An anchor is a point of a bone; its ring of surface vertices follows the bone's rigid motion.
Anchors are about a limb's radius apart, so that the surface between two anchors can bend. No anchor
lies inside the trunk, so that a turning limb does not twist the trunk. The tip of every limb has an
anchor, so that the limb follows to its end.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from solvers.skeleton.limbs import bones_in_trunk, closest_bones, limbs

RING = 10  # handles of one anchor: enough to fix its turn and its cross-section
SPACING = 0.9  # least distance between anchors of a limb, in radii of that limb
TUBE = 1.2  # length of a long bone for each of its anchors, in radii
SMALL = 0.25  # a loose component under this share of the whole is carried rigidly

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonBinding:
    """The handles that bind a surface to a skeleton, in groups, one group for each anchor.

    Attributes:
        handles: (H,) int vertex indices, each once.
        anchor: (H,) int, the anchor of each handle, 0 to A - 1.
        node: (A,) int; the node at the far end of the anchor's bone, or the fork itself.
        pivot: (A,) int; the node about which the anchor turns: the bone's near end, or the fork
            itself.
        inside: (K,) bool; whether the bone that ends at each node lies inside the trunk.
        owner: (N,) int; the nearest anchor to each vertex along its own limb.
    """

    handles: Indices
    anchor: Indices
    node: Indices
    pivot: Indices
    inside: NDArray[np.bool_]
    owner: Indices


@dataclass(frozen=True, slots=True, eq=False)
class _Anchor:
    point: Array  # (3,)
    tangent: Array  # (3,) unit, or zero at a fork
    node: int
    pivot: int


def _limb_anchors(
    limb: list[int], positions: Array, radius: float, inside: NDArray[np.bool_]
) -> list[_Anchor]:
    """Anchors of one limb's bones outside the trunk, `SPACING` radii apart."""
    anchors: list[_Anchor] = []
    travelled, last = 0.0, -np.inf
    for pivot, node in itertools.pairwise(limb):
        bone = positions[node] - positions[pivot]
        length = float(np.linalg.norm(bone))
        if length <= 0.0:
            continue
        parts = int(np.clip(round(length / max(TUBE * radius, 1e-12)), 1, 3))
        for share in (np.arange(parts) + 0.5) / parts:
            at = travelled + share * length
            if at >= last + SPACING * radius and not inside[node]:
                last = at
                anchors.append(_Anchor(positions[pivot] + share * bone, bone / length, node, pivot))
        travelled += length
    return anchors


def _with_tip(anchors: list[_Anchor], limb: list[int], positions: Array, radius: float) -> None:
    """Append an anchor at the limb's tip; it replaces a last anchor that is too near."""
    tip, pivot = limb[-1], limb[-2]
    bone = positions[tip] - positions[pivot]
    length = float(np.linalg.norm(bone))
    near = anchors and np.linalg.norm(positions[tip] - anchors[-1].point) < SPACING * radius
    if near and len(anchors) > 1:
        anchors.pop()
    tangent = bone / length if length > 0.0 else np.zeros(3)
    anchors.append(_Anchor(positions[tip], tangent, tip, pivot))


def _place_anchors(
    parents: Indices,
    positions: Array,
    nearest: Indices,
    distance: Array,
    inside: NDArray[np.bool_],
) -> list[_Anchor]:
    children = np.bincount(parents[parents >= 0], minlength=len(parents))
    root = int(np.flatnonzero(parents < 0)[0])
    overall = float(np.median(distance)) if len(distance) else 1.0
    anchors = [
        _Anchor(positions[node], np.zeros(3), node, node)
        for node in range(len(parents))
        if children[node] > 1 or node == root
    ]
    for limb in limbs(parents):
        around = distance[np.isin(nearest, limb[1:])]
        radius = float(np.median(around)) if len(around) else overall
        ours = _limb_anchors(limb, positions, radius, inside)
        if children[limb[-1]] == 0:
            _with_tip(ours, limb, positions, radius)
        anchors.extend(ours)
    return anchors


def _ring(offsets: Array, tangent: Array) -> Indices:
    """Up to RING of the candidates, spread around the bone and near the anchor's plane.

    Args:
        offsets: (n, 3) candidates relative to the anchor.
        tangent: (3,) the bone's direction, or zero where there is none.
    """
    axial = offsets @ tangent
    radial = offsets - axial[:, None] * tangent
    cost = 4.0 * axial**2 + np.einsum("ij,ij->i", radial, radial)
    order = np.argsort(cost, kind="stable")
    near = order[: 6 * RING]
    direction = radial[near] + 0.25 * axial[near, None] * tangent
    direction /= np.linalg.norm(direction, axis=1, keepdims=True) + 1e-12
    chosen = [0]
    closest = direction @ direction[0]
    penalty = np.linspace(0.0, 0.5, len(near))
    while len(chosen) < min(RING, len(near)):
        score = closest + penalty
        score[chosen] = np.inf
        chosen.append(int(np.argmin(score)))
        closest = np.maximum(closest, direction @ direction[chosen[-1]])
    return near[chosen]


def _one_rings(count: int, faces: Indices) -> csr_array:
    """(N, N): each row has entries at the vertices that share a triangle with its vertex."""
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    rows, columns = np.append(tails, heads), np.append(heads, tails)
    return csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))


def _spread(points: Array, wanted: int) -> Indices:
    """Indices of `wanted` points far from each other, the first farthest from their centre."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    gap = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(wanted, len(points)):
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen, dtype=np.int64)


def bind(
    vertices: Array,
    faces: Indices,
    parents: Indices,
    positions: Array,
    bone_of_vertex: Indices | None = None,
) -> SkeletonBinding:
    """Choose the handles that bind a surface to a skeleton.

    Every component of the surface gets handles. A small component without a ring follows the
    nearest anchor rigidly; a large one follows several anchors.

    Args:
        vertices: (N, 3) [m] rest positions.
        faces: (F, 3) triangles.
        parents: (K,) parent of each node, -1 at the root.
        positions: (K, 3) [m] rest positions of the nodes.
        bone_of_vertex: (N,) the node at the far end of each vertex's bone, by the weights of a
            rig; the nearest bone when None.
    """
    nearest, distance = closest_bones(vertices, parents, positions)
    if bone_of_vertex is not None:
        nearest = bone_of_vertex
    inside = bones_in_trunk(vertices, faces, parents, positions)
    anchors = _place_anchors(parents, positions, nearest, distance, inside)
    points = np.array([anchor.point for anchor in anchors])
    owner = _owners(vertices, nearest, parents, anchors, points)
    handles: list[int] = []
    groups: list[int] = []
    one_rings = _one_rings(len(vertices), faces)
    beside = np.zeros(len(vertices), dtype=np.bool_)  # vertices that share a triangle with a handle
    for index, anchor in enumerate(anchors):
        own = np.flatnonzero(owner == index)
        if len(own) == 0:
            continue
        # Two rings that touch would fold the triangles between them when they turn differently.
        candidates = own[~beside[own]]
        if len(candidates) < RING:
            candidates = own
        ring = candidates[_ring(vertices[candidates] - anchor.point, anchor.tangent)]
        beside[ring] = True
        beside[one_rings[ring].indices] = True
        handles.extend(ring.tolist())
        groups.extend([index] * len(ring))
    _hold_loose_components(vertices, one_rings, owner, handles, groups)
    return SkeletonBinding(
        handles=np.array(handles, dtype=np.int64),
        anchor=np.array(groups, dtype=np.int64),
        node=np.array([anchor.node for anchor in anchors], dtype=np.int64),
        pivot=np.array([anchor.pivot for anchor in anchors], dtype=np.int64),
        inside=inside,
        owner=owner,
    )


def _owners(
    vertices: Array,
    nearest: Indices,
    parents: Indices,
    anchors: list[_Anchor],
    points: Array,
) -> Indices:
    """The anchor nearest to each vertex among those of its limb and of the forks at its ends."""
    limb_of_node = np.full(len(parents), -1, dtype=np.int64)
    ends = np.full((len(parents) + 1, 2), int(np.flatnonzero(parents < 0)[0]))  # last: no limb
    for number, limb in enumerate(limbs(parents)):
        limb_of_node[limb[1:]] = number
        ends[number] = limb[0], limb[-1]
    limb_of_vertex = limb_of_node[nearest]
    owner = np.zeros(len(vertices), dtype=np.int64)
    least = np.full(len(vertices), np.inf)
    # One anchor after the other: a matrix of all distances would be too large.
    for index, (anchor, point) in enumerate(zip(anchors, points, strict=True)):
        offset = vertices - point
        gap = np.einsum("ij,ij->i", offset, offset)
        if anchor.node == anchor.pivot:
            own = (ends[limb_of_vertex] == anchor.node).any(axis=1)
        else:
            own = limb_of_vertex == limb_of_node[anchor.node]
        near = own & (gap < least)
        owner[near], least[near] = index, gap[near]
    return owner


def _hold_loose_components(
    vertices: Array, one_rings: csr_array, owner: Indices, handles: list[int], groups: list[int]
) -> None:
    """Append handles for each component that has too few handles to fix its rotation."""
    number, label = connected_components(one_rings, directed=False)
    if number == 1:
        return
    holds = np.bincount(label[handles], minlength=number)
    free = np.ones(len(vertices), dtype=bool)
    free[handles] = False
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    for component in np.flatnonzero(holds < 3):
        members = np.flatnonzero((label == component) & free)
        if len(members) == 0:
            continue
        extent = float(np.linalg.norm(np.ptp(vertices[members], axis=0)))
        chosen = members[_spread(vertices[members], RING)]
        carriers = owner[chosen]
        if extent < SMALL * size:
            carriers = np.full(len(chosen), np.bincount(owner[members]).argmax())
        handles.extend(chosen.tolist())
        groups.extend(carriers.tolist())
