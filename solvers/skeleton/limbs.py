"""Finds which bones of a limb lie inside the trunk, and where the limb leaves it.

A limb of a curve skeleton begins at the fork in the middle of the body, so its first bones lie
inside the trunk; so do the collar bones and hips of a rig. An arm must turn about its shoulder, not
about the middle of the chest, and its bones inside the trunk must not twist the trunk.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLES = 6000  # points of the surface that are tested
SECTORS = 8  # around a bone
SURROUNDED = 6  # the least sectors with surface around a bone of a limb
THICK = 1.6  # of the limb's own radius: a bone farther from the surface lies inside the trunk
KEPT = 0.45  # share of a limb that never counts as trunk

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def closest_bones(points: Array, parents: Indices, positions: Array) -> tuple[Indices, Array]:
    """Find the bone nearest to each point.

    Args:
        points: (n, 3) [m].
        parents: (K,) parent of each node, -1 at the root.
        positions: (K, 3) [m] of the nodes.

    Returns:
        (n,) the node at the far end of the nearest bone, the root where there is no bone at all;
        (n,) the distance to it [m].
    """
    best = np.full(len(points), int(np.flatnonzero(parents < 0)[0]), dtype=np.int64)
    if len(parents) == 1:
        return best, np.linalg.norm(points - positions[0], axis=1)
    nearest = np.full(len(points), np.inf)
    for node in np.flatnonzero(parents >= 0):
        start = positions[parents[node]]
        bone = positions[node] - start
        offset = points - start
        share = np.clip(offset @ bone / max(float(bone @ bone), 1e-30), 0.0, 1.0)
        gap = offset - share[:, None] * bone
        squared = np.einsum("ij,ij->i", gap, gap)
        nearer = squared < nearest
        best[nearer], nearest[nearer] = node, squared[nearer]
    return best, np.sqrt(nearest)


def limbs(parents: Indices) -> list[list[int]]:
    """Return the chains of nodes between forks, root and leaves, each from the root outward."""
    children = np.bincount(parents[parents >= 0], minlength=len(parents))
    found = []
    for node in range(len(parents)):
        if children[node] == 1 and parents[node] >= 0:
            continue
        chain = [node]
        while parents[chain[-1]] >= 0:
            chain.append(int(parents[chain[-1]]))
            if children[chain[-1]] != 1 or parents[chain[-1]] < 0:
                break
        if len(chain) > 1:
            found.append(chain[::-1])
    return found


def bones_in_trunk(
    vertices: Array, faces: Indices, parents: Indices, positions: Array
) -> NDArray[np.bool_]:
    """Return for each node whether the bone that ends there lies inside the trunk, (K,).

    Only the beginning of a limb can lie inside, at most 1 - `KEPT` of its length. A bone lies
    inside the trunk if the surface is missing on some sides of it, or is much farther away than
    around the outer part of the same limb.
    """
    points = surface_points(vertices, faces)
    nearest, distance = closest_bones(points, parents, positions)
    inside = np.zeros(len(parents), dtype=bool)
    for limb in limbs(parents):
        lengths = np.linalg.norm(np.diff(positions[limb], axis=0), axis=1)
        if not lengths.any():  # all nodes at one place
            continue
        along = np.cumsum(lengths) / lengths.sum()
        outer = np.isin(nearest, [n for n, at in zip(limb[1:], along, strict=True) if at > 0.5])
        radius = float(np.median(distance[outer])) if outer.any() else np.inf
        for pivot, node, end in zip(limb, limb[1:], along, strict=False):
            own = nearest == node
            thin = not own.any() or float(np.median(distance[own])) <= THICK * radius
            bone = positions[node] - positions[pivot]
            if end > 1.0 - KEPT or (
                thin and _sectors(points[own] - positions[pivot], bone) >= SURROUNDED
            ):
                break
            inside[node] = True
    return inside


def surface_points(vertices: Array, faces: Indices) -> Array:
    """Return about `SAMPLES` points spread evenly over the surface, always the same ones."""
    corners = vertices[faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    total = float(area.sum())
    if total <= 0.0:
        return vertices
    random = np.random.default_rng(0)
    face = np.searchsorted(np.cumsum(area), (np.arange(SAMPLES) + 0.5) / SAMPLES * total)
    face = np.minimum(face, len(faces) - 1)
    weights = random.dirichlet((1.0, 1.0, 1.0), SAMPLES)
    spread: Array = np.einsum("ni,nij->nj", weights, corners[face])
    return spread


def _sectors(offsets: Array, bone: Array) -> int:
    """The number of sectors around a bone that contain some of the points (n, 3)."""
    length = float(np.linalg.norm(bone))
    if len(offsets) == 0 or length <= 0.0:
        return 0
    axis = bone / length
    side = np.eye(3)[int(np.argmin(np.abs(axis)))]
    side = side - (side @ axis) * axis
    side /= np.linalg.norm(side)
    angle = np.arctan2(offsets @ np.cross(axis, side), offsets @ side)
    sector = np.floor((angle + np.pi) / (2.0 * np.pi) * SECTORS).astype(int) % SECTORS
    return len(np.unique(sector))
