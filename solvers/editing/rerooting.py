"""Makes another node the root of a part."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from solvers.editing.part import Bone, Node, Part, Turn, root_node, vector_of
from solvers.editing.part_pose import pose_at
from solvers.editing.turns import compacted, led_by, undone


def rerooted(part: Part, node: int, time: float) -> Part:
    """Make `node` the root. Every bone keeps its rotation at every time; now `node` stays in place.

        o--->o--->o        o<---o<---o
        a    b   node      a    b   node

    The root turns as the bone does that ended there.

    Args:
        part: the part.
        node: id of the new root.
        time: [s] at which it stays where it is seen.

    Raises:
        ValueError: no such node.
    """
    way = part.path(node)
    if len(way) == 1:
        return part
    place = vector_of(pose_at(part, time).position(node))
    turns = tuple(replace(turn, end=1.0) for each in way for turn in each.bone.turns)
    nodes = [root_node(node, compacted(turns))]
    back = {end.id: undone(end.bone.turns) for end in way}
    # Beyond a node of the way, bones are now seen from the next bone of the way, towards the root.
    seen_from = {before.id: back[after.id] for before, after in pairwise(way)}
    for start, end in zip(reversed(way[:-1]), reversed(way[1:]), strict=True):
        nodes.append(Node(start.id, end.id, _reversed(end.bone, seen_from.get(end.id))))
    on_way = {each.id for each in way}
    for each in part.nodes:
        if each.id not in on_way:
            before = seen_from.get(each.parent)
            bone = each.bone if before is None else _led_by(before, each.bone)
            nodes.append(replace(each, bone=bone))
    return Part(place, tuple(nodes))


def _led_by(before: tuple[Turn, ...], bone: Bone) -> Bone:
    return replace(bone, turns=led_by(before, bone.turns, bone.start))


def _reversed(bone: Bone, turns: tuple[Turn, ...] | None) -> Bone:
    """The bone in the other direction; it turns as `turns` say, or not."""
    stem = vector_of(-bone.vector)
    if turns is None:
        return Bone(stem)
    count = len(turns) - 1  # the last one only undoes the first modelling turn
    spread = tuple(replace(turn, end=min((at + 1) / count, 1.0)) for at, turn in enumerate(turns))
    return Bone(stem, turns=compacted(spread))
