"""Splits one bone in two and joins two into one; their motion is divided, shared, or joined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.editing.motion import UNTURNED
from solvers.editing.part import Bone, Layer, Turn, Vector, vector_of
from solvers.editing.turns import inverse, product
from solvers.skeleton.quaternions import rotate


def divided(bone: Bone, at: float) -> tuple[Bone, Bone]:
    """Split a bone and its motion: each half turns by its share, both together by the whole.

    Args:
        bone: the bone.
        at: where, in shares of its stem, inside the bone.
    """
    before = tuple(turn for turn in bone.turns if turn.end <= at)
    after = bone.turns[len(before) :]
    begin = before[-1].end if before else bone.start
    if begin < at:
        first, second = _divided(after[0], (at - begin) / (after[0].end - begin), at)
        before, after = (*before, first), (second, *after[1:])
    return replace(bone, end=at, turns=before), replace(bone, start=at, turns=after)


def parted(bone: Bone, at: float) -> tuple[Bone, Bone]:
    """Split a bone in two; each half keeps the whole motion and turns as the bone did.

    Args:
        bone: the bone.
        at: where, in shares of its stem, inside the bone or at its start.
    """
    before = tuple(replace(turn, end=min(turn.end, at)) for turn in bone.turns)
    after = tuple(replace(turn, end=max(turn.end, at)) for turn in bone.turns)
    return replace(bone, end=at, turns=before), replace(bone, start=at, turns=after)


def joined(first: Bone, second: Bone) -> Bone:
    """Join two bones into a straight one that turns by both turns together.

    Pieces of one stem become the whole again, to the last bit. Others keep their turns and clips,
    each for its share of the length, so that a node that is put there again parts them again.
    """
    straight = all(turn.model == UNTURNED for turn in second.turns)
    if straight and first.stem == second.stem and first.end == second.start:
        seam = _continued(first.turns[-1], second.turns[0])
        inner = (first.turns[-1], second.turns[0]) if seam is None else (seam,)
        return replace(first, end=second.end, turns=(*first.turns[:-1], *inner, *second.turns[1:]))
    whole = first.length + second.length
    share = first.length / whole if whole > 0.0 else 0.5
    ends = [share * _along(first, turn) for turn in first.turns]
    ends += [share + (1.0 - share) * _along(second, turn) for turn in second.turns]
    ends[-1] = 1.0
    turns = (*first.turns, *second.turns)
    return Bone(
        _chord(first, second),
        turns=tuple(replace(turn, end=end) for turn, end in zip(turns, ends, strict=True)),
    )


def _divided(turn: Turn, share: float, at: float) -> tuple[Turn, Turn]:
    first, second = [], []
    for layer in turn.layers:
        middle = layer.first + share * (layer.last - layer.first)
        first.append(replace(layer, last=middle))
        second.append(replace(layer, first=middle))
    return Turn(at, turn.model, tuple(first)), Turn(turn.end, UNTURNED, tuple(second))


def _continued(first: Turn, second: Turn) -> Turn | None:
    """Both turns as one, where the second goes on where the first ends."""
    if second.model != UNTURNED or len(first.layers) != len(second.layers):
        return None
    pairs = tuple(zip(first.layers, second.layers, strict=True))
    if not all(_goes_on(before, after) for before, after in pairs):
        return None
    layers = tuple(replace(before, last=after.last) for before, after in pairs)
    return Turn(second.end, first.model, layers)


def _goes_on(before: Layer, after: Layer) -> bool:
    return before.clip == after.clip and before.entry == after.entry and before.last == after.first


def _along(bone: Bone, turn: Turn) -> float:
    """Where a turn ends, in shares of its bone."""
    span = bone.end - bone.start
    return (turn.end - bone.start) / span if span > 0.0 else 1.0


def _chord(first: Bone, second: Bone) -> Vector:
    """From the first bone's start to the second's end as modelled, in the second's axes."""
    model = UNTURNED
    for turn in second.turns:
        model = product(model, turn.model)
    return vector_of(rotate(np.array(inverse(model)), first.vector) + second.vector)
