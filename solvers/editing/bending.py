"""Poses the bones of an animated shape: modelling turns them, and their motion continues on top."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.editing.motion import Quaternion
from solvers.editing.part import Part, quaternion_of
from solvers.editing.part_pose import pose_at
from solvers.editing.turns import inverse, led, product


def bent(part: Part, node: int, rotation: Quaternion, time: float) -> Part:
    """Turn the bone that ends at `node`, and all beyond it, about where the bone starts.

                           o
                           |
        o---o---o      o---o        a quarter turn of the second bone
        a   b  node

    M' = G^-1 R G M, with the rotation G of the bone before it at `time`: what is seen turns by R.

    Args:
        part: the part.
        node: id of the bone's end; at the root the whole part turns.
        rotation: R, a unit quaternion (x, y, z, w), world.
        time: [s] at which it is seen.

    Raises:
        ValueError: no such node.
    """
    found = part.node(node)
    wanted = quaternion_of(np.array(rotation))
    if found.parent >= 0:
        before = quaternion_of(pose_at(part, time).rotation(found.parent))
        wanted = product(product(inverse(before), wanted), before)
    return part.with_bone(node, replace(found.bone, turns=led(wanted, found.bone.turns)))
