"""How a performer's feet and hands have moved since standing upright, for feet that follow them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from runtime.driving.body.body_parts import TwoBodies
from runtime.driving.root_motion import chain_length

Array = NDArray[np.float64]

LIFTED = (0.15, 0.45)
"""Of an arm's length: a hand this far up leads a front leg not at all, and fully."""

_DOWN = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class PerformerSteps:
    """Feet and hands of a performer, left and right.

    Attributes:
        ankles: (2,) -1 where legs are not known.
        standing: (2, 3) [m] ankles from the middle of the hips while standing upright.
        hips: (2,) where the legs begin.
        hands: (2, 2) shoulder and wrist; -1 where they are not known.
        leg: [m] length of a leg; of a body without legs its height.
        arm: [m] length of an arm.
    """

    ankles: NDArray[np.int64]
    standing: Array
    hips: NDArray[np.int64]
    hands: NDArray[np.int64]
    leg: float
    arm: float

    def of_feet(self, joints: Array) -> Array:
        """How far (2, 3) [m] the feet are from standing, seen from the hips; 0 without legs.

        Args:
            joints: (J, 3) [m] the performer.
        """
        if self.ankles.min() < 0:
            return np.zeros((2, 3))
        middle = joints[self.hips].mean(axis=0)
        moves: Array = joints[self.ankles] - middle - self.standing
        return moves

    def of_hand(self, side: int, joints: Array) -> Array:
        """How far (3,) a hand is from hanging below its shoulder, in lengths of the arm.

        Args:
            side: 0 for the left one, 1 for the right one, which is known.
            joints: (J, 3) [m] the performer.
        """
        shoulder, wrist = self.hands[side]
        move: Array = (joints[wrist] - joints[shoulder]) / self.arm - _DOWN
        return move


def performer_steps(bodies: TwoBodies) -> PerformerSteps:
    """Return the feet and hands of a performer that stands upright as people do."""
    legs, arms, upright = bodies.source.legs, bodies.source.arms, bodies.upright
    ankles, hips = np.full(2, -1), np.full(2, -1)
    standing = np.zeros((2, 3))
    leg = _leg_length(bodies)
    if len(legs) == len(SIDES):
        ankles = np.array([(legs[side].lower or legs[side].upper)[-1] for side in SIDES])
        hips = np.array([legs[side].upper[0] for side in SIDES])
        standing = upright[hips] - upright[hips].mean(axis=0)
        standing[:, 1] = -leg  # a rest pose may stand with its legs apart
    hands = np.full((2, 2), -1)
    lengths = [1.0]
    for place, side in enumerate(SIDES):
        if side in arms and bodies.joints.issuperset(arms[side].upper):
            chain = (*arms[side].upper, *arms[side].lower[1:])
            hands[place] = chain[0], chain[-1]
            lengths.append(chain_length(bodies.performer.rest_positions, chain))
    arm = float(np.mean(lengths[1:] or lengths))
    return PerformerSteps(ankles, standing, hips, hands, leg, arm)


def _leg_length(bodies: TwoBodies) -> float:
    """The mean length [m] of the performer's legs; the height of one without legs."""
    legs = [(*leg.upper, *leg.lower[1:]) for leg in bodies.source.legs.values()]
    if not legs:
        return float(np.ptp(bodies.upright[:, 1]))
    return float(np.mean([chain_length(bodies.performer.rest_positions, leg) for leg in legs]))
