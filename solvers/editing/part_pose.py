"""The places of a part's nodes at a time: clips sampled, turns composed, bones placed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.editing.motion import Clip
from solvers.editing.part import Part
from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import (
    Quaternion,
    Vector,
    conjugate,
    multiply,
    normalized,
    power,
    quaternion,
    rotate,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class PartPose:
    """A part at one time.

    Attributes:
        index: where each node stands in the arrays, by its id.
        positions: (K, 3) x of the nodes, world.
        rotations: (K, 4) G of the bones that end at them, world, since rest; (x, y, z, w).
    """

    index: dict[int, int]
    positions: Array
    rotations: Array

    def position(self, node: int) -> Array:
        """Return (3,) where a node is."""
        row: Array = self.positions[self.index[node]]
        return row

    def rotation(self, node: int) -> Array:
        """Return (4,) the rotation of the bone that ends at a node."""
        row: Array = self.rotations[self.index[node]]
        return row


class PartPlayer:
    """Poses a part at any time; made once, it takes microseconds a time.

    Args:
        part: K nodes. Clips of equal value are sampled once.
    """

    def __init__(self, part: Part) -> None:
        self._index = part.index
        self._place = np.array(part.place)
        self._vectors = np.array([node.bone.vector for node in part.nodes])
        self._parents = np.array([part.index.get(node.parent, -1) for node in part.nodes])
        turns = [turn for node in part.nodes for turn in node.bone.turns]
        layers = [layer for turn in turns for layer in turn.layers]
        self._models = np.array([turn.model for turn in turns])
        self._of_bone = _starts([len(node.bone.turns) for node in part.nodes])
        self._of_turn = _starts([len(turn.layers) for turn in turns])
        clips: dict[Clip, int] = {}
        numbers = [clips.setdefault(layer.clip, len(clips)) for layer in layers]
        self._clips = tuple(clips)
        self._numbers = np.array(numbers, dtype=np.int64)
        spans = [(layer.entry, layer.first, layer.last) for layer in layers]
        self._spans = np.array(spans, dtype=np.float64).reshape(-1, 3)
        self._weights = np.array([clip.weight for clip in self._clips], dtype=np.float64)
        self._of_clip = _starts([len(clip.motion.knots) for clip in self._clips])
        knots = [clip.motion.knots for clip in self._clips]
        self._knots = np.concatenate(knots) if knots else np.empty(0)

    def at(self, time: float) -> PartPose:
        """Return the pose at a `time` [s]."""
        turns = [clip.at(time) for clip in self._clips]
        return self._posed(np.concatenate(turns) if turns else np.empty((0, 4)))

    def modelled(self) -> PartPose:
        """Return the pose that modelling made, without any motion."""
        return self._posed(np.tile([0.0, 0.0, 0.0, 1.0], (len(self._knots), 1)))

    def _posed(self, turns: Array) -> PartPose:
        positions, rotations = np.empty_like(self._vectors), np.empty((len(self._vectors), 4))
        _pose(
            self._parents,
            self._vectors,
            self._place,
            self._of_bone,
            self._models,
            self._of_turn,
            self._numbers,
            self._spans,
            self._weights,
            self._of_clip,
            self._knots,
            turns,
            positions,
            rotations,
        )
        return PartPose(self._index, positions, rotations)


def pose_at(part: Part, time: float) -> PartPose:
    """Return the pose of a part at a `time` [s]."""
    return PartPlayer(part).at(time)


def modelled_pose(part: Part) -> PartPose:
    """Return the pose of a part that modelling made, without any motion."""
    return PartPlayer(part).modelled()


def _starts(counts: list[int]) -> Indices:
    """Where each of several runs begins, and where the last one ends."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


@kernel
def _sample(knots: Array, turns: Array, begin: int, stop: int, s: float) -> Quaternion:
    """q at s; exactly a knot's where s is one."""
    at = begin
    while at + 2 < stop and knots[at + 1] <= s:
        at += 1
    share = (s - knots[at]) / (knots[at + 1] - knots[at])
    first = quaternion(turns, at)
    if share <= 0.0:
        return first
    second = quaternion(turns, at + 1)
    if share >= 1.0:
        return second
    return multiply(first, power(multiply(conjugate(first), second), share))


@kernel
def _logarithm(q: Quaternion) -> Vector:
    """The rotation vector, longer than pi where w < 0."""
    sine = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    if sine < 1e-12:
        return (2.0 * q[0], 2.0 * q[1], 2.0 * q[2])
    scale = 2.0 * math.atan2(sine, q[3]) / sine
    return (scale * q[0], scale * q[1], scale * q[2])


@kernel
def _exponential(x: float, y: float, z: float) -> Quaternion:
    half = 0.5 * math.sqrt(x * x + y * y + z * z)
    scale = 0.5 if half < 1e-12 else 0.5 * math.sin(half) / half
    return (scale * x, scale * y, scale * z, math.cos(half))


@kernel
def _stacked(
    first: int,
    last: int,
    column: int,
    numbers: Indices,
    spans: Array,
    weights: Array,
    of_clip: Indices,
    knots: Array,
    turns: Array,
) -> Quaternion:
    """Q where the layers begin (column 1) or end (column 2): logarithms since entry, added up."""
    x = y = z = 0.0
    for row in range(first, last):
        clip = numbers[row]
        begin, stop = of_clip[clip], of_clip[clip + 1]
        entry = _sample(knots, turns, begin, stop, spans[row, 0])
        here = _sample(knots, turns, begin, stop, spans[row, column])
        log = _logarithm(multiply(conjugate(entry), here))
        x += weights[clip] * log[0]
        y += weights[clip] * log[1]
        z += weights[clip] * log[2]
    return _exponential(x, y, z)


@kernel
def _animated(
    first: int,
    last: int,
    numbers: Indices,
    spans: Array,
    weights: Array,
    of_clip: Indices,
    knots: Array,
    turns: Array,
) -> Quaternion:
    """A of the layers from `first` to before `last`."""
    moving = False
    for row in range(first, last):
        moving = moving or spans[row, 1] != spans[row, 2]
    if not moving:
        return (0.0, 0.0, 0.0, 1.0)
    if last == first + 1 and weights[numbers[first]] == 1.0:
        clip = numbers[first]
        begin, stop = of_clip[clip], of_clip[clip + 1]
        start = _sample(knots, turns, begin, stop, spans[first, 1])
        return multiply(conjugate(start), _sample(knots, turns, begin, stop, spans[first, 2]))
    start = _stacked(first, last, 1, numbers, spans, weights, of_clip, knots, turns)
    end = _stacked(first, last, 2, numbers, spans, weights, of_clip, knots, turns)
    return multiply(conjugate(start), end)


@kernel
def _pose(
    parents: Indices,
    vectors: Array,
    place: Array,
    of_bone: Indices,
    models: Array,
    of_turn: Indices,
    numbers: Indices,
    spans: Array,
    weights: Array,
    of_clip: Indices,
    knots: Array,
    turns: Array,
    positions: Array,
    rotations: Array,
) -> None:
    for node in range(len(parents)):
        parent = parents[node]
        here = (0.0, 0.0, 0.0, 1.0) if parent < 0 else quaternion(rotations, parent)
        for turn in range(of_bone[node], of_bone[node + 1]):
            moved = _animated(
                of_turn[turn], of_turn[turn + 1], numbers, spans, weights, of_clip, knots, turns
            )
            here = normalized(multiply(multiply(here, quaternion(models, turn)), moved))
        rotations[node, 0], rotations[node, 1], rotations[node, 2], rotations[node, 3] = here
        bone = rotate(here, (vectors[node, 0], vectors[node, 1], vectors[node, 2]))
        for k in range(3):
            start = place[k] if parent < 0 else positions[parent, k]
            positions[node, k] = start + bone[k]
