"""How a skeleton holds the surface around it: anchors along the bones, each with a ring of handles.

An anchor is a point of a bone that takes a ring of surface vertices along with the bone's rigid
motion. Anchors stand at least a limb's radius apart, so that the surface between two of them is
free to bend as a limb does; none stands inside the body that a limb grows from, so that a turning
limb does not wring the body; the tip of every limb has one, so that it follows to the end.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

RING = 10  # handles of one anchor: enough to fix its turn and its cross-section
SPACING = 0.9  # least distance between anchors of a limb, in radii of that limb
BODY = 0.8  # share of a branching's own radius that stays free of the limbs' anchors
TUBE = 1.2  # length of limb that one anchor on a long bone keeps straight, in radii
SMALL = 0.25  # a loose component under this share of the whole is carried rigidly

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Binding:
    """What holds a surface: handles in groups, each group an anchor on the skeleton.

    Attributes:
        handles: (H,) int vertex indices, each once.
        anchor: (H,) int into the A anchors, which one holds each handle.
        node: (A,) int; the node at the far end of the anchor's bone, or the branch node itself.
        pivot: (A,) int; the node about which the anchor turns: the bone's near end, or the
            branch node itself.
    """

    handles: Indices
    anchor: Indices
    node: Indices
    pivot: Indices


@dataclass(frozen=True, slots=True, eq=False)
class _Anchor:
    point: Array  # (3,)
    tangent: Array  # (3,) unit, or zero at a branching
    node: int
    pivot: int


def closest_bones(
    vertices: Array, parents: Indices, positions: Array
) -> tuple[Indices, Array, Array]:
    """Find the bone nearest to each vertex.

    Args:
        vertices: (N, 3) [m].
        parents: (K,) parent of each node, -1 at the root.
        positions: (K, 3) [m] rest positions of the nodes.

    Returns:
        (N,) the node at the far end of the nearest bone (the root where there is no bone), (N,)
        the distance to it [m], (N,) how far along the bone, from 0 at the parent to 1.
    """
    count = len(vertices)
    best = np.full(count, int(np.flatnonzero(parents < 0)[0]), dtype=np.int64)
    distance = np.full(count, np.inf)
    along = np.ones(count)
    if len(parents) == 1:
        return best, np.linalg.norm(vertices - positions[0], axis=1), along
    for node in np.flatnonzero(parents >= 0):
        start = positions[parents[node]]
        bone = positions[node] - start
        offset = vertices - start
        share = np.clip(offset @ bone / max(float(bone @ bone), 1e-30), 0.0, 1.0)
        gap = np.linalg.norm(offset - share[:, None] * bone, axis=1)
        nearer = gap < distance
        best[nearer], distance[nearer], along[nearer] = node, gap[nearer], share[nearer]
    return best, distance, along


def _limbs(parents: Indices) -> list[list[int]]:
    """Chains of nodes between branchings, root and leaves, each from its root side outward."""
    degree = np.bincount(parents[parents >= 0], minlength=len(parents))  # children of each node
    limbs = []
    for node in range(len(parents)):
        if degree[node] == 1 and parents[node] >= 0:
            continue
        chain = [node]
        while parents[chain[-1]] >= 0:
            chain.append(int(parents[chain[-1]]))
            if degree[chain[-1]] != 1 or parents[chain[-1]] < 0:
                break
        if len(chain) > 1:
            limbs.append(chain[::-1])
    return limbs


def _limb_anchors(
    limb: list[int], positions: Array, radius: float, body: float, ends_at_leaf: bool
) -> list[_Anchor]:
    """Anchors of one limb, `body` [m] of its start left free, `SPACING` radii apart."""
    anchors: list[_Anchor] = []
    travelled, last = 0.0, body - SPACING * radius
    for pivot, node in itertools.pairwise(limb):
        bone = positions[node] - positions[pivot]
        length = float(np.linalg.norm(bone))
        if length <= 0.0:
            continue
        parts = int(np.clip(round(length / max(TUBE * radius, 1e-12)), 1, 3))
        for share in (np.arange(parts) + 0.5) / parts:
            if travelled + share * length >= last + SPACING * radius:
                last = travelled + share * length
                anchors.append(_Anchor(positions[pivot] + share * bone, bone / length, node, pivot))
        travelled += length
    if ends_at_leaf and len(limb) > 1:
        tip, pivot = limb[-1], limb[-2]
        bone = positions[tip] - positions[pivot]
        length = float(np.linalg.norm(bone))
        if anchors and travelled - last < SPACING * radius and len(anchors) > 1:
            anchors.pop()
        tangent = bone / length if length > 0.0 else np.zeros(3)
        anchors.append(_Anchor(positions[tip], tangent, tip, pivot))
    return anchors


def _place_anchors(
    parents: Indices, positions: Array, nearest: Indices, distance: Array
) -> list[_Anchor]:
    children = np.bincount(parents[parents >= 0], minlength=len(parents))
    root = int(np.flatnonzero(parents < 0)[0])
    overall = float(np.median(distance)) if len(distance) else 1.0

    def radius_of(nodes: list[int]) -> float:
        around = distance[np.isin(nearest, nodes)]
        return float(np.median(around)) if len(around) else overall

    anchors = []
    body: dict[int, float] = {}
    for node in range(len(parents)):
        if children[node] > 1 or node == root:
            around = [node, *np.flatnonzero(parents == node).tolist()]
            body[node] = radius_of(around)
            anchors.append(_Anchor(positions[node], np.zeros(3), node, node))
    for limb in _limbs(parents):
        radius = radius_of(limb[1:])
        free = BODY * max(body.get(limb[0], 0.0), radius)
        leaf = bool(children[limb[-1]] == 0)
        anchors.extend(_limb_anchors(limb, positions, radius, free, leaf))
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


def _components(count: int, faces: Indices) -> tuple[int, Indices]:
    rows = np.concatenate([faces[:, 0], faces[:, 1]])
    columns = np.concatenate([faces[:, 1], faces[:, 2]])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return int(number), label.astype(np.int64)


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
) -> Binding:
    """Choose the handles by which a skeleton holds a surface.

    Every component of the surface gets handles: one that no ring reaches is carried rigidly by
    the anchor nearest to it, or held in several places when it is large.

    Args:
        vertices: (N, 3) [m] rest positions.
        faces: (F, 3) triangles.
        parents: (K,) parent of each node, -1 at the root.
        positions: (K, 3) [m] rest positions of the nodes.
        bone_of_vertex: (N,) the node at the far end of the bone that each vertex belongs to, as
            a rig's weights say; the nearest bone when None.
    """
    nearest, distance, _ = closest_bones(vertices, parents, positions)
    if bone_of_vertex is not None:
        nearest = bone_of_vertex
    anchors = _place_anchors(parents, positions, nearest, distance)
    points = np.array([anchor.point for anchor in anchors])
    owner = _owners(vertices, nearest, parents, anchors, points)
    handles: list[int] = []
    groups: list[int] = []
    for index, anchor in enumerate(anchors):
        candidates = np.flatnonzero(owner == index)
        if len(candidates) == 0:
            continue
        ring = candidates[_ring(vertices[candidates] - anchor.point, anchor.tangent)]
        handles.extend(ring.tolist())
        groups.extend([index] * len(ring))
    _hold_loose_components(vertices, faces, owner, handles, groups)
    return Binding(
        handles=np.array(handles, dtype=np.int64),
        anchor=np.array(groups, dtype=np.int64),
        node=np.array([anchor.node for anchor in anchors], dtype=np.int64),
        pivot=np.array([anchor.pivot for anchor in anchors], dtype=np.int64),
    )


def _owners(
    vertices: Array,
    nearest: Indices,
    parents: Indices,
    anchors: list[_Anchor],
    points: Array,
) -> Indices:
    """The anchor nearest to each vertex among those of its own limb, of all where it has none."""
    limb_of_node = np.full(len(parents), -1, dtype=np.int64)
    for number, limb in enumerate(_limbs(parents)):
        limb_of_node[limb[1:]] = number
    limb_of_anchor = np.array([limb_of_node[anchor.node] for anchor in anchors])
    branching = np.array([anchor.node == anchor.pivot for anchor in anchors])
    gap = np.linalg.norm(vertices[:, None, :] - points[None, :, :], axis=2)  # (N, A)
    own = (limb_of_node[nearest][:, None] == limb_of_anchor[None, :]) | branching[None, :]
    gap = np.where(own, gap, np.inf)
    owner: Indices = np.argmin(gap, axis=1).astype(np.int64)
    return owner


def _hold_loose_components(
    vertices: Array, faces: Indices, owner: Indices, handles: list[int], groups: list[int]
) -> None:
    """Append handles for each component of the surface that too few hold to fix its turn."""
    number, label = _components(len(vertices), faces)
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
