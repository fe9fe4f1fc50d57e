"""Drives the arms of a body by two hands without a body: puts shoulders to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, Limb
from runtime.driving.body.body_parts import TwoBodies
from runtime.driving.root_motion import chain_length

Array = NDArray[np.float64]

_WIDEST = 0.7  # of an arm's length: half of the greatest width between shoulders
_BESIDE = 0.17  # [m] at most between the chest and an elbow below its shoulder


class HeldHands:
    """Makes the character's hands meet when the performer's meet, although its arms are apart.

    A sensor of hands shows one joint for both shoulders. An elbow beside it hangs below its
    shoulder. Where no elbow is known, a hand is seen from the character's shoulder so much farther
    inward, in lengths of the arm.

    Args:
        bodies: the performer, of whom both arms begin at one joint, and the character.
    """

    def __init__(self, bodies: TwoBodies) -> None:
        rest, arms = bodies.tree.positions, bodies.plan.arms
        shoulders = rest[[arms[side].upper[0] for side in SIDES]]
        length = np.mean([chain_length(rest, arms[side].chain) for side in SIDES])
        width = float(np.linalg.norm(shoulders[0] - shoulders[1]))
        self._share = min(0.5 * width / max(float(length), 1e-9), _WIDEST)
        self._arms: list[tuple[Limb, list[int], Array]] = []
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
            own = bodies.source.arms[side]
            self._arms.append(
                (own, list(bodies.performer.tree.subtree(own.upper[1])), sign * bodies.left)
            )

    def reach_from_shoulders(self, joints: Array) -> None:
        """Shift the hands of a pose (J, 3) [m], turned as the character faces, in place."""
        for arm, branch, outward in self._arms:
            way = joints[arm.upper[-1]] - joints[arm.upper[0]]
            if arm.lower:
                shift = float(np.clip(way @ outward, 0.0, _BESIDE))
            else:
                shift = self._share * float(np.linalg.norm(way))
            joints[branch] -= shift * outward


def are_held(bodies: TwoBodies) -> bool:
    """Whether the performer is two hands that begin at one joint, and the character has arms."""
    theirs, ours = bodies.source.arms, bodies.plan.arms
    if not len(theirs) == len(ours) == len(SIDES):
        return False
    return len({theirs[side].upper[0] for side in SIDES}) == 1
