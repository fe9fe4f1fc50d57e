"""Keeps arms and wings that would reach below the floor lying on it.

A bird that let its wings hang as a performer lets the arms hang would stand on them as on stilts,
and a robot with long arms could not squat. Arms give way to their own side, and forelegs, which
stand on the floor at rest, to the front. An arm that just reaches the floor while the body stands
upright is let be, as it points right.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import Chain
from runtime.driving.body.body_parts import Arm, Leg
from runtime.driving.body.rig_builder import LOW
from solvers.skeleton.quaternions import multiply
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_ASIDE = 0.3  # of an arm's length: an arm this far below the floor is laid out level
_JUST = 0.25  # of the shoulder's height: what hangs no farther below the floor is no wing
_TALL = (0.8, 0.9)  # of the shoulder's height at rest: from none to all of that is let be
_UP = np.array([0.0, 1.0, 0.0])
_THICK = 90.0  # percentile of the distances from the surface of a hand to its bones


class LongArms:
    """The arms of a character, which may reach the floor while its body is low.

    Args:
        tree: the character's nodes at rest.
        vertices: (C, 3) [m] of the surface at rest.
        owner: (C,) the node that each vertex follows most.
        arms: those that are driven absolutely.
        legs: what the body stands on.
    """

    def __init__(
        self,
        tree: Tree,
        vertices: Array,
        owner: NDArray[np.int64],
        arms: Sequence[Arm],
        legs: Sequence[Leg],
    ) -> None:
        self._rest = tree.positions
        self._soles = np.array([leg.target[2:] for leg in legs], dtype=np.int64).ravel()
        self._arms = list(arms) if legs else []
        self._nodes = [list(tree.subtree(arm.target[0])[1:]) for arm in self._arms]
        low = self._rest[:, 1].min() + LOW * np.ptp(self._rest[:, 1])
        self._stands = [bool(self._rest[arm.target[-1], 1] < low) for arm in self._arms]
        self._radii = [self._radius(arm.target, vertices, owner) for arm in self._arms]
        self._heights = [
            float(self._rest[arm.target[0], 1] - self._rest[:, 1].min()) for arm in self._arms
        ]
        self._excess = [self._hanging(number) for number in range(len(self._arms))]

    def _hanging(self, number: int) -> float:
        """How far [m] an arm that hangs reaches below the floor; 0 for a wing or a foreleg."""
        shoulder = self._rest[self._arms[number].target[0]]
        reach = np.linalg.norm(self._rest[self._nodes[number]] - shoulder, axis=1).max()
        excess = float(reach) + self._radii[number] - self._heights[number]
        most = 0.0 if self._stands[number] else _JUST * self._heights[number]
        return excess if 0.0 < excess < most else 0.0

    def _radius(self, arm: Chain, vertices: Array, owner: NDArray[np.int64]) -> float:
        """How far [m] the surface of a hand is from its bones."""
        hand = vertices[np.isin(owner, arm[-2:])]
        if not len(hand):
            return 0.0
        a, b = self._rest[arm[-2]], self._rest[arm[-1]]
        along = (hand - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-12)
        gaps = hand - a - np.clip(along, 0.0, 1.0)[:, None] * (b - a)
        return float(np.percentile(np.linalg.norm(gaps, axis=1), _THICK))

    def raise_arms(
        self, positions: Array, rotations: Array, given: Array, left: Array, above: float
    ) -> bool:
        """Put the rotations that keep the arms above the floor into `given` (S, 4).

        Args:
            positions: (K, 3) [m] of the posed nodes.
            rotations: (K, 4) of the posed nodes.
            given: (S, 4) rotations of the segments, is changed.
            left: (3,) the chest's left.
            above: [m] how far the feet are above where they stand.

        Returns:
            Whether any arm is too low.
        """
        if not self._arms:
            return False
        soles = positions[self._soles, 1] - self._rest[self._soles, 1]
        floor = float(soles.min()) + float(self._rest[:, 1].min()) - max(above, 0.0)
        shoulders = [arm.target[0] for arm in self._arms]
        middle = positions[shoulders if len(shoulders) > 1 else self._soles].mean(axis=0)
        forward = np.cross(left, _UP)
        raised = False
        for number, arm in enumerate(self._arms):
            shoulder = positions[arm.target[0]]
            ways = positions[self._nodes[number]] - shoulder
            low = int(np.argmin(ways[:, 1]))
            aside = forward if self._stands[number] else (shoulder - middle) @ left * left
            height = float(shoulder[1]) - floor
            tall = np.interp(height / self._heights[number], _TALL, (0.0, 1.0))
            room = height - self._radii[number] + float(tall) * self._excess[number]
            turn = _raised(ways[low], room, aside)
            if turn is None:
                continue
            raised = True
            for segment, node in zip(arm.segments, arm.starts, strict=True):
                given[segment] = multiply(turn, rotations[node])
        return raised


def _raised(way: Array, room: float, aside: Array) -> Array | None:
    """The rotation (4,) that lifts the end of an arm onto the floor; None where it is above.

    Args:
        way: (3,) [m] from the shoulder to the lowest part of the arm.
        room: [m] from the floor to the shoulder.
        aside: (3,) where the arm lies down if it hangs.
    """
    length, below = float(np.linalg.norm(way)), -float(way[1]) - room
    if below <= 0.0 or length < 1e-9:
        return None
    level = way * (1.0, 0.0, 1.0)
    outward = aside * (1.0, 0.0, 1.0)
    size = float(np.linalg.norm(outward))
    if size > 1e-9:
        level = level + min(below / (_ASIDE * length), 1.0) * length / size * outward
    far = float(np.linalg.norm(level))
    if far < 1e-9:
        return None
    drop = float(np.clip(room / length, -1.0, 1.0))
    goal = np.sqrt(1.0 - drop * drop) * level / far - (0.0, drop, 0.0)
    own = way / length
    turn = np.append(np.cross(own, goal), 1.0 + own @ goal)
    norm = float(np.linalg.norm(turn))
    return turn / norm if norm > 1e-9 else None
