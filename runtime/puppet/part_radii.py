"""How thick the parts of a body are around their bones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Chain
from solvers.skeleton.limbs import closest_bones, surface_points
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_FEW = 8  # points of the surface: they tell no radius


def part_radii(
    vertices: Array, faces: NDArray[np.int64], tree: Tree, plan: BodyPlan
) -> NDArray[np.float64]:
    """Return the radius (K,) [m] of the part to which the bone that ends at each node belongs.

    An arm is as thick as its outer half, for its beginning may lie inside the trunk; both arms are
    alike. A leg that is thinner than the trunk counts as half way between them (as a factor), for
    the trunk ends there: a thick one would take the feet of short legs, and legs as thick as it
    the belly of a toy that sits. What belongs to no part, such as an ear, has its own radius.

    Args:
        vertices: (N, 3) [m] surface at rest.
        faces: (F, 3) into `vertices`.
        tree: the nodes at rest, rooted at the hips.
        plan: the parts of the body.
    """
    points = surface_points(vertices, faces)
    nearest, distance = closest_bones(points, tree.parents, tree.positions)
    radii = np.full(len(tree), float(np.median(distance)))
    known = np.zeros(len(tree), dtype=np.bool_)

    def measure(parts: Sequence[Chain], around: Sequence[Chain]) -> None:
        near = np.isin(nearest, [node for chain in around for node in chain])
        nodes = [node for chain in parts for node in chain]
        known[nodes] = True
        if np.count_nonzero(near) >= _FEW:
            radii[nodes] = float(np.median(distance[near]))

    measure([plan.trunk], [plan.trunk[1:]])
    trunk = radii[plan.hips]
    for chain in (plan.head[1:], plan.tail[1:], *plan.fingers.values()):
        measure([chain], [chain])
    for pair in (plan.arms, plan.legs, *plan.more_legs):
        limbs = [pair[side].chain for side in SIDES if side in pair]
        measure(limbs, [limb[len(limb) // 2 + 1 :] for limb in limbs])
        if pair is not plan.arms:
            for limb in limbs:
                own = radii[list(limb)]
                radii[list(limb)] = np.maximum(own, np.sqrt(trunk * own))
    for node in tree.order:
        if not known[node] and tree.parents[node] >= 0:
            branch = tuple(each for each in tree.subtree(node) if not known[each])
            measure([branch], [branch])
    return radii
