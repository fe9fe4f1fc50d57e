"""Build the rest skeletons of other makers from points on the bones of the humanoid body."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from devices.bodies.humanoid import humanoid_skeleton
from devices.skeleton import Skeleton

JointOnHumanoid = tuple[str, str, str, float]
"""A joint's parent ("" for the root), two bones of the humanoid, and the joint's place on the line
from the start of the first bone (0) to the start of the second (1); it may lie beyond either."""


def at(parent: str, bone: str) -> JointOnHumanoid:
    """Return a joint that lies at the start of a humanoid bone."""
    return parent, bone, bone, 0.0


def skeleton_on_humanoid(points: Mapping[str, JointOnHumanoid]) -> Skeleton:
    """Return the joints of `points`, in their order, on a 1.7 m body in a T-pose facing +Z."""
    human = humanoid_skeleton()
    places = {name: human.rest_positions[joint] for joint, name in enumerate(human.names)}
    names = tuple(points)
    rest = [
        (1.0 - share) * places[first] + share * places[second]
        for _, first, second, share in points.values()
    ]
    parents = [names.index(parent) if parent else -1 for parent, *_ in points.values()]
    return Skeleton(names, np.array(parents), np.array(rest))
