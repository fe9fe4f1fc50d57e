"""Adds nodes to an animated part and removes them; the total turning stays the same."""

from __future__ import annotations

from dataclasses import replace

from solvers.editing.bone_splits import divided, joined
from solvers.editing.part import Bone, Node, Part, Vector


def with_node(part: Part, node: int, share: float) -> Part:
    """Add a node on the bone that ends at `node`; it gets the id `part.next_id`.

        o-----------o        o-----o-----o        one turn by 90 degrees: now 45 and 45 more
        a           b        a    new    b

    Args:
        part: the part.
        node: id of the bone's end.
        share: of the bone's length, between 0 and 1.

    Raises:
        ValueError: no such node, the root, or a share that leaves no bone on one side.

    Source: AniMesh, section 6 and figure 6b.
    """
    old = _with_bone(part, node)
    bone = old.bone
    at = bone.start + share * (bone.end - bone.start)
    if not bone.start < at < bone.end:
        raise ValueError(f"a node on bone {node} needs a share between 0 and 1, got {share:g}")
    first, second = divided(bone, at)
    new = Node(part.next_id, old.parent, first)
    row = part.index[node]
    after = replace(old, parent=new.id, bone=second)
    return replace(part, nodes=(*part.nodes[:row], new, after, *part.nodes[row + 1 :]))


def without_node(part: Part, node: int) -> Part:
    """Remove a node; the bones beyond it start where its own did, and turn as both did.

        o-----o-----o        o-----------o        clips of both stay, each for its share (figure 13)
        a   node    b        a           b

    A node that was added leaves no trace, to the last bit. At a leaf its bone goes.

    Raises:
        ValueError: no such node, or the root.

    Source: AniMesh, section 6; figure 13, where the paper gives up the motion.
    """
    old = _with_bone(part, node)
    nodes = []
    for each in part.nodes:
        if each.parent == node:
            nodes.append(replace(each, parent=old.parent, bone=joined(old.bone, each.bone)))
        elif each.id != node:
            nodes.append(each)
    return replace(part, nodes=tuple(nodes))


def with_tip(part: Part, node: int, vector: Vector) -> Part:
    """Add a bone at a node; its end gets the id `part.next_id`. It turns rigidly with the node.

        o-----o        o-----o-----o
        a   node       a   node   new

    Args:
        part: the part.
        node: where it starts.
        vector: (x, y, z) of the bone at rest.

    Raises:
        ValueError: no such node.
    """
    part.node(node)
    return replace(part, nodes=(*part.nodes, Node(part.next_id, node, Bone(vector))))


def _with_bone(part: Part, node: int) -> Node:
    found = part.node(node)
    if found.parent < 0:
        raise ValueError(f"node {node} is the root, where no bone ends; choose another")
    return found
