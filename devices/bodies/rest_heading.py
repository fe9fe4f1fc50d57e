"""The direction in which a body faces at rest, from its plan."""

from __future__ import annotations

import numpy as np

from devices.bodies.body_plan import SIDES, BodyPlan
from devices.skeleton import Skeleton
from solvers.retarget.heading import heading


def rest_heading(skeleton: Skeleton, plan: BodyPlan) -> float:
    """Return the heading [rad] of a body at rest, from +Z towards +X; 0 if nothing shows it.

    A body on four legs looks from its hips to its shoulders, which are far apart; the hips alone
    are narrow, and a step turns them. A body that lies and has no pairs of limbs looks from its
    hips to its head. Any other body looks across its hips and shoulders.
    """
    rest = skeleton.rest_positions
    pairs = [
        [limbs[side].upper[0] for side in SIDES]
        for limbs in (plan.legs, plan.arms)
        if len(limbs) == len(SIDES)
    ]
    if not pairs and plan.head:
        x, y, z = rest[plan.head[-1]] - rest[plan.hips]
        return float(np.arctan2(x, z)) if np.hypot(x, z) > abs(y) else 0.0
    across = heading(rest.copy(), np.array(pairs, dtype=np.int64).reshape(-1, 2))
    if len(pairs) < 2:
        return across
    hips, shoulders = (rest[pair].mean(axis=0) for pair in pairs)
    x, y, z = shoulders - hips
    widest = max(float(np.linalg.norm(rest[left] - rest[right])) for left, right in pairs)
    along = float(np.arctan2(x, z))
    level = np.hypot(x, z) > max(abs(y), widest)
    return along if level and np.cos(along - across) > 0.0 else across
