"""Lets legs that bend at rest, as an animal's do, give way as far as the performer's legs do.

A leg that is bent already shortens faster than a straight one when its knee bends on. Turned joint
by joint, an animal would crouch wherever its performer walks. So its ankle comes nearer to its hip
by the same share as the performer's, and is where the performer's points; the knee follows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from runtime.driving.body.body_parts import Leg, TwoBodies
from solvers.retarget.two_bone_ik import two_bone_turns
from solvers.skeleton.quaternions import between, multiply, rotate

Array = NDArray[np.float64]

_NOTHING = 1e-9  # [m]


class BentLegs:
    """The L legs of a character that bend at rest; of most bodies there are none.

    Args:
        bodies: the performer and the character.
        legs: the character's legs that are driven.
    """

    def __init__(self, bodies: TwoBodies, legs: Sequence[Leg]) -> None:
        bent = [leg for leg in legs if leg.is_bent]
        sources = np.array([leg.source[:3] for leg in bent], dtype=np.int64).reshape(-1, 3)
        self._hips, self._ankles = sources[:, 0], sources[:, 2]
        self._joints = np.array([leg.target[:3] for leg in bent], dtype=np.int64).reshape(-1, 3)
        self._segments = np.array([leg.segments[:2] for leg in bent], dtype=np.int64).reshape(-1, 2)
        upright = bodies.upright[self._ankles] - bodies.upright[self._hips]
        self._long = np.maximum(np.linalg.norm(upright, axis=1, keepdims=True), _NOTHING)
        # Feet that are set apart at rest, as in the first pose of many files, do not stand so.
        self._along = upright - (upright @ bodies.left)[:, None] * bodies.left
        self._along /= np.maximum(np.linalg.norm(self._along, axis=1, keepdims=True), _NOTHING)
        rest = bodies.tree.positions
        self._ways = rest[self._joints[:, 2]] - rest[self._joints[:, 0]]

    def follow(
        self, joints: Array, positions: Array, rotations: Array, left: Array, given: Array
    ) -> bool:
        """Put the rotations of thighs and shins into `given` (S, 4); return whether there are any.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
            positions: (K, 3) [m] of the nodes, their legs turned joint by joint.
            rotations: (K, 4) of the nodes.
            left: (3,) the body's left, about which knees bend.
            given: is changed.
        """
        if not len(self._segments):
            return False
        ways = joints[self._ankles] - joints[self._hips]
        lengths = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), _NOTHING)
        turned = rotate(between(self._along, ways / lengths), self._ways)
        goals = positions[self._joints[:, 0]] + lengths / self._long * turned
        turns = two_bone_turns(
            positions[self._joints], goals, np.tile(left, (len(self._segments), 1))
        )
        given[self._segments] = multiply(turns, rotations[self._joints[:, :2]])
        return True
