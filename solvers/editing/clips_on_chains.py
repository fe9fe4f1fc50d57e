"""Puts clips on chains of bones, takes them off, and says which clip runs where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from solvers.editing.motion import Clip
from solvers.editing.part import Bone, Layer, Node, Part


class LaidClip(NamedTuple):
    """A clip on a chain.

    Attributes:
        clip: the clip.
        first, last: its parameters where the chain begins and ends.
    """

    clip: Clip
    first: float
    last: float


def with_clip(part: Part, chain: Sequence[int], laid: LaidClip) -> Part:
    """Put a clip on a chain of bones, on top of others, by arc length of the bones.

        o-----o---o        o-----o---o
                           0    .6   1   of the clip

    Args:
        part: the part.
        chain: ids of its nodes, two at least, each the parent of the next.
        laid: the clip, and how much of it.

    Raises:
        ValueError: no such nodes, or nodes that are no chain outward.
    """
    ends = _bones(part, chain)
    lengths = [node.bone.length for node in ends]
    if sum(lengths) == 0.0:
        lengths = [1.0] * len(ends)
    whole, passed = sum(lengths), 0.0
    for node, length in zip(ends, lengths, strict=True):
        first = _between(laid, passed / whole)
        passed += length
        last = laid.last if node is ends[-1] else _between(laid, passed / whole)
        part = part.with_bone(node.id, _laid_on(node.bone, LaidClip(laid.clip, first, last)))
    return part


def without_clip(part: Part, clip: Clip) -> Part:
    """Take a clip off all bones."""
    nodes = []
    for node in part.nodes:
        turns = tuple(
            replace(turn, layers=tuple(layer for layer in turn.layers if layer.clip != clip))
            for turn in node.bone.turns
        )
        nodes.append(replace(node, bone=replace(node.bone, turns=turns)))
    return replace(part, nodes=tuple(nodes))


def clips_on(part: Part, chain: Sequence[int]) -> tuple[LaidClip, ...]:
    """Return the clips on a chain, to be laid on another: a copy of its motion.

    Each with the parameters at which it comes onto the chain and leaves it.

    Raises:
        ValueError: as of `with_clip`.
    """
    found: dict[Clip, LaidClip] = {}
    for node in _bones(part, chain):
        for turn in node.bone.turns:
            for layer in turn.layers:
                first = found.get(layer.clip, LaidClip(layer.clip, layer.first, layer.last)).first
                found[layer.clip] = LaidClip(layer.clip, first, layer.last)
    return tuple(found.values())


def parameters_at(part: Part, node: int) -> tuple[tuple[Clip, float], ...]:
    """Return the pairs of clip and parameter at a node: of its own bone's end, then of each next.

    At a grafting node they differ: (orange, 0.6) ends there, and (cyan, 0.3) begins.

    Source: AniMesh, figure 13.
    """
    pairs = [(layer.clip, layer.last) for layer in part.node(node).bone.turns[-1].layers]
    for child in part.children(node):
        pairs += [(layer.clip, layer.first) for layer in child.bone.turns[0].layers]
    return tuple(dict.fromkeys(pairs))


def _bones(part: Part, chain: Sequence[int]) -> list[Node]:
    if len(chain) < 2:
        raise ValueError(f"a chain has two nodes at least, got {list(chain)}")
    ends = [part.node(number) for number in chain[1:]]
    for start, end in zip(chain, ends, strict=False):
        if end.parent != part.node(start).id:
            raise ValueError(f"no bone leads outward from node {start} to node {end.id}")
    return ends


def _between(laid: LaidClip, share: float) -> float:
    return laid.first + share * (laid.last - laid.first)


def _laid_on(bone: Bone, laid: LaidClip) -> Bone:
    span = bone.end - bone.start
    turns = []
    for begin, end, turn in bone.spans():
        shares = ((begin - bone.start) / span, (end - bone.start) / span) if span else (0.0, 1.0)
        first = _between(laid, shares[0])
        last = laid.last if end == bone.end else _between(laid, shares[1])
        layer = Layer(laid.clip, laid.first, first, last)
        turns.append(replace(turn, layers=(*turn.layers, layer)))
    return replace(bone, turns=tuple(turns))
