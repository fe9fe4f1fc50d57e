"""Skeletons of other makers, laid on the built-in body: where their joints are at rest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from devices.bodies.humanoid import humanoid_skeleton
from devices.skeleton import Skeleton

JointOnHumanoid = tuple[str, str, str, float]
"""A joint's parent, "" for the root; two bones of the humanoid; the share of the way from where the
first begins to where the second does, beyond 1 or not."""


def at(parent: str, bone: str) -> JointOnHumanoid:
    """A joint that begins where a bone of the humanoid does."""
    return parent, bone, bone, 0.0


def skeleton_on_humanoid(points: Mapping[str, JointOnHumanoid]) -> Skeleton:
    """The joints of `points`, in their order, on a body of 1.7 m in a T-pose that faces +Z."""
    human = humanoid_skeleton()
    places = {name: human.rest_positions[joint] for joint, name in enumerate(human.names)}
    names = tuple(points)
    rest = [
        (1.0 - share) * places[first] + share * places[second]
        for _, first, second, share in points.values()
    ]
    parents = [names.index(parent) if parent else -1 for parent, *_ in points.values()]
    return Skeleton(names, np.array(parents), np.array(rest))
