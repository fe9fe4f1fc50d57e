"""Steps a body of many legs as its performer steps: its feet go where the performer's feet go.

A leg that arches up from the body and down to the floor cannot point where a performer's leg
points. So its foot is moved as far as the performer's ankle has moved from standing, and its knee
bends for it. Legs beside each other step in turn, as those of spiders and insects do: each takes
the step of the performer's other leg, but spreads with its own. The front pair steps along too,
and follows the performer's arms when these are lifted.

The gait of alternate legs: D. M. Wilson (1966), "Insect walking".
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan
from runtime.driving.body.body_parts import Step, TwoBodies
from runtime.driving.body.performer_steps import LIFTED, performer_steps
from runtime.driving.root_motion import chain_length
from solvers.retarget.two_bone_ik import two_bone_turns
from solvers.skeleton.quaternions import multiply, rotate

Array = NDArray[np.float64]

_STRETCH = 0.02  # of the room below: feet reach so far below the floor, when the performer's do


class ManyLegs:
    """The legs of a character that has more than two pairs.

    Args:
        bodies: the performer and the character.
        steps: the legs.
        room: [m] how far the trunk can sink.

    Attributes:
        ratio: the character's way for each metre of the performer's: a leg length is as far as from
            one foot to the next on the same side.
    """

    def __init__(self, bodies: TwoBodies, steps: Sequence[Step], room: float) -> None:
        tree, rest = bodies.tree, bodies.tree.positions
        self._performer = performer_steps(bodies)
        self._room = room
        self._left = bodies.left
        self._joints = np.array([step.target for step in steps], dtype=np.int64)
        self._segments = np.array([step.segments for step in steps], dtype=np.int64)
        self._carriers = np.array([tree.parents[step.target[0]] for step in steps])
        self._rest = rest[self._joints]
        self._own = np.array([SIDES.index(step.side) for step in steps])
        self._led_by = np.where([step.in_turn for step in steps], 1 - self._own, self._own)
        self._arms = np.array([step.by_arm for step in steps])
        self._long = np.array([chain_length(rest, step.target) for step in steps])
        # A knee that stands straight above its foot bends outward.
        across = np.cross(self._rest[:, 1] - self._rest[:, 0], self._rest[:, 2] - self._rest[:, 0])
        self._axes = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
        self.ratio = _stride(bodies.plan, rest) / max(self._performer.leg, 1e-9)

    def step(self, joints: Array, positions: Array, rotations: Array, given: Array) -> None:
        """Put the rotations of the legs into `given` (S, 4), those of all segments.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
            positions: (K, 3) [m] of the nodes, without the steps.
            rotations: (K, 4) of the nodes, without the steps.
            given: is changed.
        """
        goals = self._rest[:, 2] + self._moves(joints)
        carry = rotations[self._carriers]
        hips = positions[self._joints[:, 0]]
        knees = hips + rotate(carry, self._rest[:, 1] - self._rest[:, 0])
        feet = knees + rotate(carry, self._rest[:, 2] - self._rest[:, 1])
        limbs = np.stack([hips, knees, feet], axis=1)
        turns = two_bone_turns(limbs, goals, rotate(carry, self._axes))
        given[self._segments] = multiply(turns, carry[:, None])

    def _moves(self, joints: Array) -> Array:
        """How far (L, 3) [m] each foot is from its place at rest, seen from the hips."""
        steps = self._steps(joints)
        moves = steps[self._led_by]
        moves += ((steps[self._own] - moves) @ self._left)[:, None] * self._left
        arms = np.flatnonzero(self._arms & (self._performer.hands[self._own, 0] >= 0))
        for leg in arms:
            move = self._performer.of_hand(int(self._own[leg]), joints)
            share = float(np.interp(move[1], LIFTED, (0.0, 1.0)))
            moves[leg] = (1.0 - share) * moves[leg] + share * self._long[leg] * move
        return moves

    def _steps(self, joints: Array) -> Array:
        """How far (2, 3) [m] the performer's feet are from standing, in the character's size."""
        steps: Array = self.ratio * self._performer.of_feet(joints)
        if self._performer.ankles.min() < 0:
            return steps
        # The trunk sinks as the performer's, but not into the floor.
        rise = float(steps[:, 1].min())
        steps[:, 1] += float(np.clip(rise, -_STRETCH * self._room, self._room)) - rise
        return steps


def _stride(plan: BodyPlan, rest: Array) -> float:
    """The median distance [m] of neighbouring feet on one side."""
    gaps = []
    for side in SIDES:
        pairs = (plan.arms, *plan.more_legs, plan.legs)
        feet = [rest[pair[side].chain[-1]] for pair in pairs if side in pair]
        gaps += [float(np.linalg.norm(b - a)) for a, b in pairwise(feet)]
    return float(np.median(gaps))
