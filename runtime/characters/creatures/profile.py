"""The plan of a flat picture of an animal seen from its side: a leg in front and a leg behind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import BodyPlan, Chain, Limb
from devices.bodies.joint_names import Side
from devices.bodies.limb_segments import bend_between, neck_and_head
from runtime.characters.creatures.limbless import headness, longest_path
from solvers.skeleton.limbs import closest_bones, surface_points
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_FLAT = 0.01  # of the size
_STANDS = 0.25  # of the height: a leg ends below
_LEAST = 0.04  # of the size: a shorter branch is no leg
_FALLS = 0.5  # of its length: so much a leg leads down
_MOST = 2  # legs that are drawn at one end of the trunk


def plan_of_profile(vertices: Array, faces: NDArray[np.int64], tree: Tree) -> BodyPlan | None:
    """Return the plan of an animal drawn from its side; None for any other body.

    Its spine is the longest line, which lies. Legs lead down from it to the floor, one or two in
    front and one or two behind. Of two the one that begins nearer to the head is on the far side.

    Args:
        vertices: (N, 3) [m] surface at rest, +Y up.
        faces: (F, 3) into `vertices`.
        tree: the skeleton's nodes at rest [m].
    """
    extent = np.ptp(vertices, axis=0)
    spine = longest_path(tree)
    x, y, _ = np.abs(tree.positions[spine[-1]] - tree.positions[spine[0]])
    if extent[2] > _FLAT * extent.max() or y > x:
        return None
    points = surface_points(vertices, faces)
    if headness(tree, spine, *closest_bones(points, tree.parents, tree.positions)) < 0.0:
        spine = spine[::-1]
    floor, height = float(vertices[:, 1].min()), float(extent[1])
    legs = _legs(tree, spine, _LEAST * float(extent.max()), floor + _STANDS * height)
    roots = [spine.index(leg[0]) for leg in legs]
    if len(legs) < 2 or roots[0] == roots[-1]:
        return None
    cut = int(np.argmax(np.diff(roots))) + 1  # the longest way between two legs is the trunk
    hind, front = legs[:cut], legs[cut:]
    if max(len(hind), len(front)) > _MOST:
        return None
    return _plan(tree, spine, hind, front)


def _legs(tree: Tree, spine: Chain, least: float, low: float) -> list[Chain]:
    """The branches of a spine that lead down to the floor, from its tail on."""
    found = []
    for leaf in tree.leaves:
        path = tree.chain(spine[0], leaf)
        start = max(place for place, node in enumerate(path) if node in spine)
        leg = path[start:]
        length = tree.length(leg)
        fall = float(tree.positions[leg[0], 1] - tree.positions[leaf, 1])
        if length > least and fall > _FALLS * length and tree.positions[leaf, 1] < low:
            found.append(leg)
    return sorted(found, key=lambda leg: spine.index(leg[0]))


def _plan(tree: Tree, spine: Chain, hind: Sequence[Chain], front: Sequence[Chain]) -> BodyPlan:
    hips, chest = spine.index(hind[0][0]), spine.index(front[-1][0])
    head, tail = spine[chest:], spine[hips::-1]
    pieces = neck_and_head(head, tree.positions)
    ahead = tree.positions[spine[-1], 0] - tree.positions[spine[0], 0]
    near = Side.LEFT if ahead < 0.0 else Side.RIGHT  # who looks to the picture's left shows it
    far = Side.RIGHT if near is Side.LEFT else Side.LEFT

    def limbs(legs: Sequence[Chain]) -> Mapping[Side, Limb]:
        return {
            side: Limb(*bend_between(leg[1:] if len(leg) > 3 else leg, tree.positions))
            for side, leg in zip((near, far), legs, strict=False)
        }

    return BodyPlan(
        trunk=spine[hips : chest + 1],
        head=head if len(head) > 1 else (),
        skull=(pieces[-1][0] if len(pieces) > 1 else head[0]) if len(head) > 1 else None,
        arms=limbs(front),
        legs=limbs(hind),
        tail=tail if len(tail) > 1 else (),
        arm_word="foreleg",
        leg_word="hind leg",
    )
