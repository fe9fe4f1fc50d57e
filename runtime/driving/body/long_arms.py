"""Keeps wings and long arms, which would reach below the floor, lying on it.

A bird that let its wings hang as a performer lets the arms hang would stand on them as on stilts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import Chain
from runtime.driving.body.body_parts import Arm, Leg
from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]

_LONG = 1.1  # of the shoulder height: a shorter arm is let be, as it points right
_ABOVE = 0.02  # of the height: how far above the floor the nodes stay, for what is around them
_ASIDE = 0.3  # of an arm's length: an arm this far below the floor is laid out to its side


class LongArms:
    """The arms of a character that reach the floor.

    Args:
        nodes: (K, 3) [m] at rest.
        arms: those that are driven absolutely.
        legs: what the body stands on.
    """

    def __init__(self, nodes: Array, arms: Sequence[Arm], legs: Sequence[Leg]) -> None:
        self._rest = nodes
        self._soles = np.array([leg.target[2:] for leg in legs], dtype=np.int64).ravel()
        self._margin = _ABOVE * float(np.ptp(nodes[:, 1]))
        self._arms = [arm for arm in arms if legs and self._is_long(arm.target)]

    def _is_long(self, arm: Chain) -> bool:
        length = np.linalg.norm(np.diff(self._rest[list(arm)], axis=0), axis=1).sum()
        return bool(length > _LONG * (self._rest[arm[0], 1] - self._rest[:, 1].min()))

    def raise_arms(self, positions: Array, rotations: Array, given: Array) -> bool:
        """Put the rotations that keep the arms above the floor into `given` (S, 4).

        Args:
            positions: (K, 3) [m] of the posed nodes.
            rotations: (K, 4) of the posed nodes.
            given: (S, 4) rotations of the segments, is changed.

        Returns:
            Whether any arm is too low.
        """
        if not self._arms:
            return False
        soles = positions[self._soles, 1] - self._rest[self._soles, 1]
        floor = float(soles.min()) + float(self._rest[:, 1].min()) + self._margin
        middle = positions[[arm.target[0] for arm in self._arms]].mean(axis=0)
        raised = False
        for arm in self._arms:
            shoulder = positions[arm.target[0]]
            ways = positions[list(arm.target[1:])] - shoulder
            low = int(np.argmin(ways[:, 1]))
            turn = _raised(ways[low], shoulder[1] - floor, shoulder - middle)
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
        aside: (3,) to which side the arm lies down if it hangs.
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
