"""The places of a part's nodes at a time: clips sampled, turns composed, bones placed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.editing.motion import Clip, slerped
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
from solvers.skeleton.quaternions import multiply as multiplied

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
        # Neighbouring bones meet at one place of a clip: each place is sampled once.
        places: dict[tuple[int, float], int] = {}
        ways: dict[tuple[int, int], int] = {}
        rows = []
        for layer in layers:
            number = clips.setdefault(layer.clip, len(clips))
            entry, first, last = (
                places.setdefault((number, s), len(places))
                for s in (layer.entry, layer.first, layer.last)
            )
            from_entry = [ways.setdefault((entry, each), len(ways)) for each in (first, last)]
            rows.append((first, last, *from_entry))
        self._clips = tuple(clips)
        self._layers = np.array(rows, dtype=np.int64).reshape(-1, 4)
        self._weights = np.array([layer.clip.weight for layer in layers], dtype=np.float64)
        self._ways = np.array(list(ways), dtype=np.int64).reshape(-1, 2)
        self._counts = [len(clip.motion.knots) for clip in self._clips]
        self._at, self._share = _places(list(places), [clip.motion.knots for clip in self._clips])
        changes = np.array([clip.change for clip in self._clips]).reshape(-1, 4)
        self._changes = np.repeat(changes, self._counts, axis=0)

    def at(self, time: float) -> PartPose:
        """Return the pose at a `time` [s]."""
        if not self._clips:
            return self.modelled()
        around = [clip.motion.between(clip.moment(time)) for clip in self._clips]
        first, second = (np.concatenate([frames[k] for frames in around]) for k in (0, 1))
        shares = np.repeat(np.array([share for _, _, share in around]), self._counts)
        turns = slerped(first, second, shares[:, None])
        back = self._changes * np.array([-1.0, -1.0, -1.0, 1.0])
        return self._posed(multiplied(multiplied(self._changes, turns), back))

    def modelled(self) -> PartPose:
        """Return the pose that modelling made, without any motion."""
        return self._posed(np.tile([0.0, 0.0, 0.0, 1.0], (sum(self._counts), 1)))

    def _posed(self, turns: Array) -> PartPose:
        positions, rotations = np.empty_like(self._vectors), np.empty((len(self._vectors), 4))
        _pose(
            self._parents,
            self._vectors,
            self._place,
            self._of_bone,
            self._models,
            self._of_turn,
            self._layers,
            self._weights,
            self._ways,
            self._at,
            self._share,
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


def _places(places: list[tuple[int, float]], knots: list[Array]) -> tuple[Indices, Array]:
    """The knot (S,) of all clips' before each place, and how far it is to the next one (S,)."""
    starts = _starts([len(each) for each in knots])
    at, share = np.zeros(len(places), np.int64), np.zeros(len(places))
    numbers = np.array([number for number, _ in places], dtype=np.int64)
    values = np.array([s for _, s in places])
    for number, own in enumerate(knots):
        mine = numbers == number
        before = np.clip(np.searchsorted(own, values[mine], side="right") - 1, 0, len(own) - 2)
        at[mine] = starts[number] + before
        share[mine] = (values[mine] - own[before]) / (own[before + 1] - own[before])
    return at, share


@kernel
def _sample(turns: Array, at: int, share: float) -> Quaternion:
    """q between two knots; exactly a knot's where it is one."""
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
    begin: int, stop: int, column: int, layers: Indices, weights: Array, logs: Array
) -> Quaternion:
    """Q where the layers begin (column 2) or end (column 3): logarithms since entry, added up."""
    x = y = z = 0.0
    for row in range(begin, stop):
        way = layers[row, column]
        x += weights[row] * logs[way, 0]
        y += weights[row] * logs[way, 1]
        z += weights[row] * logs[way, 2]
    return _exponential(x, y, z)


@kernel
def _animated(
    begin: int, stop: int, layers: Indices, weights: Array, samples: Array, logs: Array
) -> Quaternion:
    """A of the layers from `begin` to before `stop`."""
    moving = False
    for row in range(begin, stop):
        moving = moving or layers[row, 0] != layers[row, 1]
    if not moving:
        return (0.0, 0.0, 0.0, 1.0)
    if stop == begin + 1 and weights[begin] == 1.0:
        start = quaternion(samples, layers[begin, 0])
        return multiply(conjugate(start), quaternion(samples, layers[begin, 1]))
    start = _stacked(begin, stop, 2, layers, weights, logs)
    return multiply(conjugate(start), _stacked(begin, stop, 3, layers, weights, logs))


@kernel
def _pose(
    parents: Indices,
    vectors: Array,
    place: Array,
    of_bone: Indices,
    models: Array,
    of_turn: Indices,
    layers: Indices,
    weights: Array,
    ways: Indices,
    at: Indices,
    share: Array,
    turns: Array,
    positions: Array,
    rotations: Array,
) -> None:
    samples = np.empty((len(at), 4))
    for s in range(len(at)):
        q = _sample(turns, at[s], share[s])
        samples[s, 0], samples[s, 1], samples[s, 2], samples[s, 3] = q
    logs = np.empty((len(ways), 3))
    for way in range(len(ways)):
        entry = conjugate(quaternion(samples, ways[way, 0]))
        log = _logarithm(multiply(entry, quaternion(samples, ways[way, 1])))
        logs[way, 0], logs[way, 1], logs[way, 2] = log
    for node in range(len(parents)):
        parent = parents[node]
        here = (0.0, 0.0, 0.0, 1.0) if parent < 0 else quaternion(rotations, parent)
        for turn in range(of_bone[node], of_bone[node + 1]):
            begin, stop = of_turn[turn], of_turn[turn + 1]
            moved = _animated(begin, stop, layers, weights, samples, logs)
            here = normalized(multiply(multiply(here, quaternion(models, turn)), moved))
        rotations[node, 0], rotations[node, 1], rotations[node, 2], rotations[node, 3] = here
        bone = rotate(here, (vectors[node, 0], vectors[node, 1], vectors[node, 2]))
        for k in range(3):
            start = place[k] if parent < 0 else positions[parent, k]
            positions[node, k] = start + bone[k]
