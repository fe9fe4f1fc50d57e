"""Recognises the body of a character by its shape, if no names of its joints tell its limbs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from devices.bodies.body_plan import BodyPlan
from devices.bodies.rest_heading import rest_heading
from devices.skeleton import Skeleton
from runtime.characters.body_nodes.body_nodes import body_nodes
from runtime.characters.character import Character
from runtime.characters.creatures.limbless import plan_of_limbless
from runtime.characters.creatures.many_legs import plan_of_many_legs
from runtime.characters.creatures.profile import plan_of_profile
from runtime.characters.plan_by_shape import plan_by_shape
from solvers.skeleton.limbs import surface_points
from solvers.skeleton.mirror_plane import SYMMETRIC, MirrorPlane, mirror_planes
from solvers.skeleton.rejoined import rejoined

_PLANES = 4  # that are tried


def with_body_by_shape(character: Character) -> Character:
    """Return the character with the plan of its body, None where the shape is not clear.

    A limb that an extracted skeleton hangs on the foot of its partner is hung on the trunk.
    """
    points = surface_points(character.vertices, character.faces)
    if not np.ptp(points, axis=0).max() > 0.0:
        return character
    planes = mirror_planes(points, _PLANES)
    skeleton = character.skeleton
    if character.weights is None and planes and planes[0].asymmetry < SYMMETRIC:
        parents = rejoined(skeleton.tree, planes[0], float(np.ptp(points, axis=0).max()))
        if parents is not None:
            skeleton = Skeleton(skeleton.names, parents, skeleton.rest_positions)
    surface = character.vertices, character.faces
    plan = plan_by_shape(*surface, skeleton.tree, planes)
    if plan is None or character.weights is not None:
        plan = plan or plan_of_many_legs(*surface, skeleton.tree, planes)
        plan = plan or plan_of_limbless(*surface, skeleton.tree)
        plan = plan or plan_of_profile(*surface, skeleton.tree)
        return replace(character, skeleton=skeleton, plan=plan)
    body = body_nodes(
        character.vertices,
        character.faces,
        points,
        skeleton.tree,
        plan,
        _plane_of(planes, skeleton, plan),
    )
    return replace(character, skeleton=skeleton, plan=plan, body=body)


def _plane_of(planes: list[MirrorPlane], skeleton: Skeleton, plan: BodyPlan) -> MirrorPlane:
    """The mirror plane between the left and the right of a body."""
    facing = rest_heading(skeleton, plan)
    left = np.array([np.cos(facing), 0.0, -np.sin(facing)])
    return max(planes, key=lambda plane: abs(float(plane.normal @ left)))
