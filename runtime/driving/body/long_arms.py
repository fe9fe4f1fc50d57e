"""Lays arms and wings that would reach below the floor on the floor.

A bird that let its wings hang as a performer lets the arms hang would stand on them as on stilts,
and a robot with long arms could not squat. Arms give way to their own side, and forelegs, which
stand on the floor at rest, to the front. An arm that just reaches the floor while the body stands
upright points right; only its hand gives way.

Of a wing that is longer than its shoulder is high, the range from hanging to level is first spread
over the angle that the floor leaves, so that each pose of the performer's arm looks different.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.driving.body.body_parts import Arm, Leg
from runtime.driving.body.rig_builder import LOW
from solvers.retarget.limb_posing import lift_segments
from solvers.skeleton.quaternions import multiply
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

_ASIDE = 0.3  # of an arm's length: an arm this far below the floor is laid out level
_JUST = 0.25  # of the shoulder's height: what hangs farther below the floor is a wing
_WITH_HAND = 3  # segments
_THICK = 90.0  # percentile of the distances from the surface of a hand to its bones


class LongArms:
    """The arms of a character, which may reach the floor while its body is low.

    Args:
        tree: the character's nodes at rest.
        vertices: (C, 3) [m] of the surface at rest.
        owner: (C,) the node that each vertex follows most.
        arms: those that are driven.
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
        self._radii = [self._radius(number, vertices, owner) for number in range(len(self._arms))]
        self._heights = [
            float(self._rest[arm.target[0], 1] - self._rest[:, 1].min()) for arm in self._arms
        ]
        self._hands = [self._yielding(number) for number in range(len(self._arms))]
        self._reaches = [_reach(self._rest, arm) for arm in self._arms]
        self._segments = [np.array(arm.segments, dtype=np.int64) for arm in self._arms]
        self._joints = [np.array((*arm.starts, arm.target[-1])) for arm in self._arms]

    def _yielding(self, number: int) -> list[int]:
        """The nodes of a hand that gives way, as hanging it just reaches the floor; else none."""
        arm, nodes = self._arms[number], self._nodes[number]
        if len(arm.segments) < _WITH_HAND or self._stands[number]:
            return []
        away = np.linalg.norm(self._rest[nodes] - self._rest[arm.target[0]], axis=1)
        height = self._heights[number]
        if float(away.max()) + self._radii[number] > (1.0 + _JUST) * height:
            return []
        wrist = float(np.linalg.norm(self._rest[arm.starts[-1]] - self._rest[arm.target[0]]))
        return [node for node, far in zip(nodes, away, strict=True) if far > wrist]

    def _radius(self, number: int, vertices: Array, owner: NDArray[np.int64]) -> float:
        """How far [m] the surface of a hand is from its bones; below them, of one that stands."""
        arm = self._arms[number].target
        hand = vertices[np.isin(owner, arm[-2:])]
        if not len(hand):
            return 0.0
        a, b = self._rest[arm[-2]], self._rest[arm[-1]]
        along = (hand - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-12)
        gaps = hand - a - np.clip(along, 0.0, 1.0)[:, None] * (b - a)
        radius = float(np.percentile(np.linalg.norm(gaps, axis=1), _THICK))
        if self._stands[number]:
            lowest = float(self._rest[self._nodes[number], 1].min() - self._rest[:, 1].min())
            return min(radius, lowest)
        return radius

    def spread_wings(
        self, positions: Array, rotations: Array, given: Array, left: Array, above: float
    ) -> bool:
        """Put the rotations that lift all parts of wings into `given` (S, 4).

        What points from level to straight down then points from level to as steeply as the whole
        wing may without reaching the floor. What points up is let be.

        Args:
            positions, rotations, given, left, above: as of `raise_arms`.

        Returns:
            Whether any wing is lifted.
        """
        if not self._arms:
            return False
        floor, asides, lifted = self.floor(positions, above), None, False
        for number, arm in enumerate(self._arms):
            reach = self._reaches[number]
            is_wing = reach + self._radii[number] > (1.0 + _JUST) * self._heights[number]
            room = float(positions[arm.target[0], 1]) - floor - self._radii[number]
            if self._stands[number] or not is_wing or room >= reach:
                continue
            share = float(np.arcsin(max(room / reach, 0.0))) / (0.5 * np.pi)
            segments, joints = self._segments[number], self._joints[number]
            if asides is None:
                asides = self._asides(positions, left)
            aside = asides[number]
            lifted |= lift_segments(positions, rotations, segments, joints, share, aside, given)
        return lifted

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
        floor, asides = self.floor(positions, above), self._asides(positions, left)
        raised = False
        for number, arm in enumerate(self._arms):
            aside = asides[number]
            above_floor = floor + self._radii[number]
            hand = self._hands[number]
            nodes = [node for node in self._nodes[number] if node not in hand]
            turn = _raised(*_lowest(positions, arm.target[0], nodes, above_floor), aside)
            segments, starts = arm.segments, arm.starts
            if hand:
                wrist = starts[-1]
                given_way = _raised(*_lowest(positions, wrist, hand, above_floor), aside)
                if given_way is not None:
                    given[segments[-1]] = multiply(given_way, rotations[wrist])
                    segments, starts, raised = segments[:-1], starts[:-1], True
            if turn is None:
                continue
            raised = True
            for segment, node in zip(segments, starts, strict=True):
                given[segment] = multiply(turn, rotations[node])
        return raised

    def floor(self, positions: Array, above: float) -> float:
        """Return the height [m] of the floor below feet that are `above` [m] where they stand."""
        soles = positions[self._soles, 1] - self._rest[self._soles, 1]
        return float(soles.min()) + float(self._rest[:, 1].min()) - max(above, 0.0)

    def _asides(self, positions: Array, left: Array) -> list[Array]:
        """Where each arm lies down if it hangs, (3,): to its own side, a foreleg forward."""
        shoulders = [arm.target[0] for arm in self._arms]
        middle = positions[shoulders if len(shoulders) > 1 else self._soles].mean(axis=0)
        forward = np.array([-left[2], 0.0, left[0]])
        return [
            forward if stands else (positions[shoulder] - middle) @ left * left
            for stands, shoulder in zip(self._stands, shoulders, strict=True)
        ]


def _reach(rest: Array, arm: Arm) -> float:
    """The length [m] of an arm that is stretched out."""
    joints = rest[[*arm.starts, arm.target[-1]]]
    return float(np.linalg.norm(np.diff(joints, axis=0), axis=1).sum())


def _lowest(
    positions: Array, start: int, nodes: Sequence[int], floor: float
) -> tuple[Array, float]:
    """The way (3,) [m] from a node to the lowest of others, and how far it is above the floor."""
    ways = positions[list(nodes)] - positions[start]
    return ways[int(np.argmin(ways[:, 1]))], float(positions[start, 1]) - floor


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
