"""How the trunk of an animal on four legs follows: it rears, and leans less than its performer.

It rears when both arms of its performer go up. Its forelegs are the arms, so they rise with them; a
trunk that stayed level would hang in the air. The chest rises fully, the pelvis and the head less,
so that the spine arches and a tail stays above the floor. Who walks leans forward a little, and an
animal whose trunk did that would press its chest down onto its forelegs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, Limb
from runtime.driving.body.body_parts import TwoBodies
from runtime.driving.body.forelegs import is_on_four
from solvers.skeleton.quaternions import multiply, rotate

Array = NDArray[np.float64]

MOST = np.radians(55.0)
"""The angle by which the chest rises when both arms point straight up."""

_RISES = (-0.6, 0.7)  # sine of the lower arm's elevation: from level to fully reared
_LEAN = np.radians(15.0)  # a lean of which a trunk on four legs takes half
_LEANING = np.array([1.0, 1.0, 0.0])  # pelvis and chest; the head looks where it looked
_SHARES = np.array([0.5, 1.0, 0.5])  # of pelvis, chest and head


class Rearing:
    """How far the trunk of a character rears and leans.

    Args:
        bodies: the performer and the character.
    """

    def __init__(self, bodies: TwoBodies) -> None:
        pairs = list(bodies.pairs(bodies.source.arms, bodies.plan.arms))
        rears = len(pairs) == len(SIDES) and is_on_four(bodies.plan, bodies.tree.positions)
        chains = [_to_wrist(theirs) for _, theirs, _ in pairs] if rears else []
        self._leans = rears and not is_on_four(bodies.source, bodies.upright)
        self._arms = [np.array(chain, dtype=np.int64) for chain in chains]

    def reared(self, trunk: Array, joints: Array, left: Array) -> Array:
        """Return the turns (3, 4) of pelvis, chest and head as an animal has them.

        Args:
            trunk: (3, 4) world rotations from standing upright.
            joints: (J, 3) [m] the performer, turned as the character faces.
            left: (3,) unit, the body's left.
        """
        if self._leans:
            trunk = pitched(trunk, _lean(trunk, left), left)
        angle = self.angle(joints)
        if angle == 0.0:
            return trunk
        return pitched(trunk, angle * _SHARES, left)

    def angle(self, joints: Array) -> float:
        """Return the angle [rad] by which the chest rises above its place on four legs."""
        if not self._arms:
            return 0.0
        low, high = _RISES
        share = (min(_elevation(joints[arm]) for arm in self._arms) - low) / (high - low)
        share = float(np.clip(share, 0.0, 1.0))
        return float(MOST) * share * share * (3.0 - 2.0 * share)


def pitched(trunk: Array, angles: Array, left: Array) -> Array:
    """Return the turns (3, 4) of pelvis, chest and head that rise by angles (3,) [rad] in front.

    Args:
        trunk: (3, 4) world rotations.
        angles: (3,) [rad].
        left: (3,) unit, the body's left.
    """
    half = -0.5 * angles[:, None]
    return multiply(np.concatenate([np.sin(half) * left, np.cos(half)], axis=1), trunk)


def _lean(turns: Array, left: Array) -> Array:
    """How far (3,) [rad] pelvis and chest lean less than the performer's.

    Args:
        turns: (3, 4) of the performer's pelvis, chest and head from standing upright.
        left: (3,) unit, the body's left.
    """
    x, y, z = rotate(turns, np.array([0.0, 1.0, 0.0])).T
    angles = np.arctan2(z * left[0] - x * left[2], y)
    less: Array = _LEANING * angles * _LEAN / (np.abs(angles) + _LEAN)
    return less


def _to_wrist(arm: Limb) -> tuple[int, ...]:
    bends = (arm.upper[0], arm.upper[-1])
    return (*bends, arm.lower[-1]) if arm.lower else bends


def _elevation(arm: Array) -> float:
    """The height of the wrist above the shoulder, of the arm's length; -1 to 1."""
    length = float(np.linalg.norm(np.diff(arm, axis=0), axis=1).sum())
    return float(arm[-1, 1] - arm[0, 1]) / length if length > 0.0 else -1.0
