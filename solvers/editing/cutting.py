"""Cuts bones at any place and time; the parts that come off keep their motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.editing.bone_splits import parted
from solvers.editing.part import Node, Part, Turn, quaternion_of, root_node, vector_of
from solvers.editing.part_pose import pose_at
from solvers.skeleton.quaternions import rotate


def cut(part: Part, node: int, share: float, time: float) -> tuple[Part, Part]:
    """Cut the bone that ends at `node`; return what keeps the root, and what comes off.

        o-----------o---o        o-----o   o-----o---o
        a          node b        a   new   new  node b

    Both pieces of the bone keep all of its motion, so they go on turning as it did: the kept one at
    every time, the other against where the bone before the cut was at `time`, as what was beyond
    does. The cut node is the root of the part that comes off, and has the id `part.next_id` on both
    sides. At share 0 the bone comes off whole and its start stays as it is.

    Args:
        part: the part.
        node: id of the bone's end.
        share: of the bone's length, from 0 to below 1.
        time: [s] at which all stays where it is seen.

    Raises:
        ValueError: no such node, the root, or a share out of its range.

    Source: AniMesh, section 6 and figure 7. The paper gives the pieces a part of the motion each
    and adds the difference to M, which is right at `time` only.
    """
    old = part.node(node)
    if old.parent < 0 or not 0.0 <= share < 1.0:
        raise ValueError(
            f"a cut needs a bone and a share from 0 to below 1, got node {node} and {share:g}"
        )
    bone = old.bone
    at = bone.start + share * (bone.end - bone.start)
    pose = pose_at(part, time)
    turned = pose.rotation(node)
    place = pose.position(node) - rotate(turned, (bone.end - at) * np.array(bone.stem))
    kept, off = parted(bone, at)
    branch = part.branch(node)
    taken = {each.id for each in branch}
    rest = tuple(each for each in part.nodes if each.id not in taken)
    new = part.next_id
    stub = (Node(new, old.parent, kept),) if at > bone.start else ()
    before = Turn(1.0, quaternion_of(pose.rotation(old.parent)))
    beyond = (root_node(new, (before,)), replace(old, parent=new, bone=off), *branch[1:])
    return replace(part, nodes=(*rest, *stub)), Part(vector_of(place), beyond)


def branch_of(part: Part, node: int, time: float) -> Part:
    """Return a copy of the bone that ends at `node` and all beyond it, with their motion.

        o---o---o---o            o---o---o
        a   b  node d            b  node d

    Args and Raises: as of `cut`; the part itself stays whole.
    """
    return cut(part, node, 0.0, time)[1]


def without_branch(part: Part, node: int) -> Part:
    """Delete the bone that ends at `node` and all beyond it, with their motion.

        o---o---o---o            o---o
        a   b  node d            a   b

    Raises:
        ValueError: no such node, or the root.
    """
    if part.node(node).parent < 0:
        raise ValueError(f"node {node} is the root, and the whole part would go")
    taken = {each.id for each in part.branch(node)}
    return replace(part, nodes=tuple(each for each in part.nodes if each.id not in taken))
