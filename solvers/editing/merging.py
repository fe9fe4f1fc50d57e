"""Merges an animated part onto a node of another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.editing.part import Bone, Node, Part, Turn, quaternion_of, vector_of
from solvers.editing.part_pose import pose_at
from solvers.editing.turns import inverse, led, led_by, product, snapped
from solvers.skeleton.quaternions import conjugate, rotate

TOGETHER = 1e-9
"""Nodes that are closer than this share of both parts' lengths are one."""


def merged(base: Part, graft: Part, node: int, time: float) -> Part:
    """Merge a part onto a node of another, whose root stays the root.

        o---o   +   o---o        o---o---o
        a  node     r   b        a  node b

    Everything stays as it is seen at `time`, and the graft goes on moving as it did, against the
    bone that ends at `node`. Its root becomes one with the node where both are in one place; else
    it stays and a stiff bone leads to it. What was cut off there is as if it had never been:
    the bones beyond a cut turn with the kept piece at every time. Nodes of the graft
    keep their ids unless the base has one of them; then all of them count on from `base.next_id`.

    Args:
        base: what is grafted onto.
        graft: what is grafted, moved to its place before (`solvers.editing.placing`).
        node: id of the base's grafting node.
        time: [s] at which all stays where it is seen.

    Raises:
        ValueError: the base has no such node.

    Source: AniMesh, section 6 and figure 8: M' = G_node(t)^-1 G_b(t) A_b(t)^-1. The paper leaves
    open where the graft is and how large: both stay as seen.
    """
    end, start = base.node(node), graft.root
    pose, there = pose_at(base, time), pose_at(graft, time)
    turned = pose.rotation(node)
    gap = np.array(graft.place) - pose.position(node)
    together = float(np.linalg.norm(gap)) <= TOGETHER * (_length(base) + _length(graft))
    moving = graft.nodes[1:] if together else graft.nodes
    first = base.next_id if any(each.id in base.index for each in moving) else 0
    ids = {each.id: at + first if first else each.id for at, each in enumerate(moving)}
    hub = node if together else ids[start.id]
    link = Node(hub, node, Bone(vector_of(rotate(conjugate(turned), gap))))
    below = inverse(quaternion_of(turned))
    grafted = [] if together else [link]
    for each in graft.nodes[1:]:
        bone, parent = each.bone, ids.get(each.parent, hub)
        if each.parent == start.id:
            parent = hub
            seen = product(below, quaternion_of(there.rotation(each.id)))
            cut_here = together and _was_one(end.bone, start.bone, bone)
            bone = _healed(bone, seen) if cut_here else _led(bone, start.bone, below)
        grafted.append(Node(ids[each.id], parent, bone))
    return replace(base, nodes=(*base.nodes, *grafted))


def _length(part: Part) -> float:
    return sum(node.bone.length for node in part.nodes)


def _led(bone: Bone, root: Bone, below: tuple[float, float, float, float]) -> Bone:
    """The bone after the graft's root, with what turned the root, as seen from the new bone."""
    return replace(bone, turns=led_by(led(below, root.turns), bone.turns, bone.start))


def _was_one(kept: Bone, root: Bone, off: Bone) -> bool:
    """Whether two bones are the pieces of one that was cut: both have all of its motion."""
    moves = tuple(turn.layers for turn in off.turns)
    return (
        kept.stem == off.stem
        and kept.end == off.start
        and any(moves)
        and moves == tuple(turn.layers for turn in kept.turns)
        and not any(turn.layers for turn in root.turns)
    )


def _healed(bone: Bone, seen: tuple[float, float, float, float]) -> Bone:
    """The piece beyond a cut, which the piece before it turns now; its clips go on from there."""
    ends = tuple(replace(layer, first=layer.last) for layer in bone.turns[-1].layers)
    return replace(bone, turns=(Turn(bone.end, snapped(seen), ends),))
