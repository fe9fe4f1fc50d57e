"""Layers of motion on the nodes of a tree: each turns and shifts nodes on top of those below.

A layer turns nodes in the axes of their parents. An overriding layer takes each node a share of the
way from what the layers below make of it to its own turn; an adding layer puts a share of its own
turn after that. Both are quaternion logarithms that are scaled: q exp(w log(q^-1 p)), q exp(w log
p). Shifts, which change the length of bones or move the root, are blended as numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import (
    Quaternion,
    conjugate,
    multiply,
    normalized,
    power,
    quaternion,
    rotate,
)
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class LayerFrame:
    """D nodes of one layer at one moment, between two frames of its motion.

    Attributes:
        nodes: (D,) the nodes, each once.
        turns: two arrays (D, 4), unit quaternions (x, y, z, w) in the parents' axes, from rest.
        shifts: two arrays (D, 3), in the parents' axes, from where each node rests.
        share: of the second frame, in [0, 1].
    """

    nodes: Indices
    turns: tuple[Singles, Singles]
    shifts: tuple[Singles, Singles]
    share: float = 0.0


class LayeredNodes:
    """Stacks layers on the nodes of a tree.

    Args:
        tree: K nodes at rest.

    Attributes:
        turns: (K, 4) of all layers so far, in the parents' axes; unit quaternions from rest.
        shifts: (K, 3) of all layers so far, in the parents' axes.
    """

    def __init__(self, tree: Tree) -> None:
        order = np.array(tree.order, dtype=np.int64)
        self._links = np.column_stack([order, tree.parents[order]])
        self._rest = np.ascontiguousarray(tree.positions)
        self.turns = np.empty((len(tree), 4))
        self.shifts = np.empty((len(tree), 3))
        self.clear()

    def clear(self) -> None:
        """Take all layers off: every node rests."""
        self.turns[:] = (0.0, 0.0, 0.0, 1.0)
        self.shifts[:] = 0.0

    def override(self, frame: LayerFrame, weight: float) -> None:
        """Add a layer that moves its nodes by a share `weight` in [0, 1] to its own pose."""
        _override(self.turns, self.shifts, *_operands(frame), weight)

    def add(self, frame: LayerFrame, weight: float) -> None:
        """Add a layer that turns its nodes further, by a share `weight` of its own turns."""
        _add(self.turns, self.shifts, *_operands(frame), weight)

    def world(self) -> tuple[Array, Array]:
        """Return positions (K, 3) and world rotations from rest (K, 4) of the nodes."""
        positions, rotations = np.empty_like(self._rest), np.empty_like(self.turns)
        _world(self._links, self._rest, self.turns, self.shifts, positions, rotations)
        return positions, rotations

    def local(self, positions: Array, rotations: Array) -> tuple[Array, Array]:
        """Return turns (K, 4) and shifts (K, 3) that place the nodes there: the inverse of `world`.

        Args:
            positions: (K, 3).
            rotations: (K, 4) world rotations from rest.
        """
        turns, shifts = np.empty_like(self.turns), np.empty_like(self._rest)
        _local(self._links, self._rest, positions, rotations, turns, shifts)
        return turns, shifts


def _operands(
    frame: LayerFrame,
) -> tuple[Indices, Singles, Singles, Singles, Singles, float]:
    return (frame.nodes, *frame.turns, *frame.shifts, frame.share)


@kernel
def _single(rows: Singles, at: int) -> Quaternion:
    """Row `at` as a unit quaternion; files hold it in single precision."""
    x, y = np.float64(rows[at, 0]), np.float64(rows[at, 1])
    return normalized((x, y, np.float64(rows[at, 2]), np.float64(rows[at, 3])))


@kernel
def _towards(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """The share of the shorter way from `a` to `b`; the ends themselves are met exactly."""
    if share <= 0.0:
        return a
    if share >= 1.0:
        return b
    turn = multiply(conjugate(a), b)
    if turn[3] < 0.0:
        turn = (-turn[0], -turn[1], -turn[2], -turn[3])
    return normalized(multiply(a, _part(turn, share)))


@kernel
def _part(turn: Quaternion, share: float) -> Quaternion:
    """`power`; by series within 12 degrees, as from frame to frame, to 1e-11 in half the time."""
    square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
    if square > 0.01:
        return power(turn, share)
    arc = 1.0 + square * (1 / 6 + square * (3 / 40 + square * (5 / 112 + square * 35 / 1152)))
    part = share * arc  # times the sine of half the turn is half the angle
    angle = part * part * square
    scale = part * (1.0 - angle / 6 * (1.0 - angle / 20 * (1.0 - angle / 42)))
    w = 1.0 - angle / 2 * (1.0 - angle / 12 * (1.0 - angle / 30 * (1.0 - angle / 56)))
    return (turn[0] * scale, turn[1] * scale, turn[2] * scale, w)


@kernel
def _override(
    turns: Array,
    shifts: Array,
    nodes: Indices,
    first: Singles,
    second: Singles,
    before: Singles,
    after: Singles,
    share: float,
    weight: float,
) -> None:
    for row in range(len(nodes)):
        node = nodes[row]
        own = _towards(_single(first, row), _single(second, row), share)
        turned = _towards(quaternion(turns, node), own, weight)
        turns[node, 0], turns[node, 1], turns[node, 2], turns[node, 3] = turned
        for k in range(3):
            shift = (1.0 - share) * before[row, k] + share * after[row, k]
            shifts[node, k] = (1.0 - weight) * shifts[node, k] + weight * shift


@kernel
def _add(
    turns: Array,
    shifts: Array,
    nodes: Indices,
    first: Singles,
    second: Singles,
    before: Singles,
    after: Singles,
    share: float,
    weight: float,
) -> None:
    for row in range(len(nodes)):
        node = nodes[row]
        own = _towards(_single(first, row), _single(second, row), share)
        if own[3] < 0.0:
            own = (-own[0], -own[1], -own[2], -own[3])
        turned = normalized(multiply(quaternion(turns, node), power(own, weight)))
        turns[node, 0], turns[node, 1], turns[node, 2], turns[node, 3] = turned
        for k in range(3):
            shift = (1.0 - share) * before[row, k] + share * after[row, k]
            shifts[node, k] += weight * shift


@kernel
def _world(
    links: Indices, rest: Array, turns: Array, shifts: Array, positions: Array, rotations: Array
) -> None:
    for step in range(len(links)):
        node, parent = links[step, 0], links[step, 1]
        own = quaternion(turns, node)
        if parent < 0:
            rotations[node, 0], rotations[node, 1], rotations[node, 2], rotations[node, 3] = own
            for k in range(3):
                positions[node, k] = rest[node, k] + shifts[node, k]
            continue
        above = quaternion(rotations, parent)
        bone = rotate(
            above,
            (
                rest[node, 0] - rest[parent, 0] + shifts[node, 0],
                rest[node, 1] - rest[parent, 1] + shifts[node, 1],
                rest[node, 2] - rest[parent, 2] + shifts[node, 2],
            ),
        )
        turned = normalized(multiply(above, own))
        rotations[node, 0], rotations[node, 1], rotations[node, 2], rotations[node, 3] = turned
        for k in range(3):
            positions[node, k] = positions[parent, k] + bone[k]


@kernel
def _local(
    links: Indices, rest: Array, positions: Array, rotations: Array, turns: Array, shifts: Array
) -> None:
    for step in range(len(links)):
        node, parent = links[step, 0], links[step, 1]
        own = normalized(quaternion(rotations, node))
        if parent < 0:
            for k in range(3):
                shifts[node, k] = positions[node, k] - rest[node, k]
        else:
            back = conjugate(normalized(quaternion(rotations, parent)))
            own = normalized(multiply(back, own))
            bone = rotate(
                back,
                (
                    positions[node, 0] - positions[parent, 0],
                    positions[node, 1] - positions[parent, 1],
                    positions[node, 2] - positions[parent, 2],
                ),
            )
            for k in range(3):
                shifts[node, k] = bone[k] - (rest[node, k] - rest[parent, k])
        turns[node, 0], turns[node, 1], turns[node, 2], turns[node, 3] = own
