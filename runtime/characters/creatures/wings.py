"""Tells wings from arms in a body without names: wings are long and flat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan
from solvers.skeleton.limbs import closest_bones
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_LONG = 1.25  # times the height of their shoulders
_FLAT = 3.0  # times as wide as thick, by standard deviations
_SHEET = 0.02  # of its width: a body that is no thicker is a sheet, all of whose limbs are flat
_FEWEST = 10  # points that show a shape


def are_wings(points: Array, tree: Tree, plan: BodyPlan) -> bool:
    """Whether the arms of a body are wings.

    Args:
        points: (n, 3) [m] spread over the surface at rest, +Y up.
        tree: the nodes at rest.
        plan: the parts of the body.
    """
    if not plan.arms or _is_flat(points, 1.0 / _SHEET):
        return False
    tree = tree.rerooted(plan.hips)
    nearest, _ = closest_bones(points, tree.parents, tree.positions)
    floor = float(points[:, 1].min())
    for arm in plan.arms.values():
        own = points[np.isin(nearest, tree.subtree(arm.chain[1]))]
        shoulder = float(tree.positions[arm.chain[0], 1]) - floor
        if tree.length(arm.chain) < _LONG * shoulder or not _is_flat(own, _FLAT):
            return False
    return True


def _is_flat(points: Array, times: float) -> bool:
    """Whether some points (n, 3) spread so many times as far across as in their thickness."""
    if len(points) < _FEWEST:
        return False
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points.T)), 0.0))
    return bool(spread[1] > times * spread[0])
