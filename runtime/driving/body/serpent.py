"""Lets a body without limbs that lies, such as a snake, raise its front part like a cobra.

A body on the floor cannot show how a performer's trunk stands. So its front part stands up, with
the head level, and bows, bends and turns as the performer's trunk. Who crouches lets it sink. It
has no arms to lift: it stretches when both of the performer's arms go up, and sways to the side to
which the hands go.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES
from runtime.driving.body.bearing import Bearing
from runtime.driving.body.body_parts import TwoBodies
from runtime.driving.root_motion import chain_length
from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]

_RAISED = (np.radians(40.0), np.radians(85.0))  # the chest while the arms hang, while they are up
_SWAY = np.radians(40.0)  # the chest when both hands reach out to one side
_HEAD = 0.5  # of the sway, that the head keeps
_CROUCHED, _STANDING = 0.45, 0.95  # heights of the shoulders, of standing: lies flat, is raised
_SLENDER = 8.0  # lengths in heights: a thicker body, such as a fish, stays as it is
_BEARS = np.array([0.0, 1.0, 1.0])  # shares of the tilts of pelvis, chest and head


class Serpent:
    """How the front part of a body without limbs is raised.

    Args:
        bodies: the performer and the character.

    Attributes:
        reach: [m] the length of what is raised.
    """

    def __init__(self, bodies: TwoBodies) -> None:
        plan, source, rest = bodies.plan, bodies.source, bodies.tree.positions
        self.reach = chain_length(rest, (*plan.trunk, *plan.head[1:]))
        self._elevation = _elevation(rest[plan.hips], rest[plan.trunk[-1]])
        front = np.array([np.sin(bodies.facing), 0.0, np.cos(bodies.facing)])
        self._front, self._left = front, np.array([front[2], 0.0, -front[0]])
        self._hips = [limb.upper[0] for limb in source.legs.values()]
        self._feet = [(limb.lower or limb.upper)[-1] for limb in source.legs.values()]
        self._arms = [
            (limb.upper[0], (limb.lower or limb.upper)[-1])
            for side, limb in source.arms.items()
            if side in SIDES and bodies.joints.issuperset(limb.upper)
        ]
        self._arm = float(
            np.mean(
                [
                    chain_length(bodies.performer.rest_positions, limb.upper + limb.lower[1:])
                    for limb in source.arms.values()
                ]
                or [1.0]
            )
        )
        self._height = self._above_feet(bodies.upright)

    def bearing(self, joints: Array) -> Bearing:
        """Return the bearing of the body for a pose of the performer.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
        """
        ways = [(joints[wrist] - joints[shoulder]) / self._arm for shoulder, wrist in self._arms]
        lift, sway = 0.0, 0.0
        if ways:
            lift = 0.5 + 0.5 * float(np.clip(np.mean([way[1] for way in ways]), -1.0, 1.0))
            sway = _SWAY * float(np.clip(0.5 * sum(way @ self._left for way in ways), -1.0, 1.0))
        raised = np.interp(lift, (0.0, 1.0), _RAISED) * self._stands(joints) - self._elevation
        up = _about(self._left, -max(float(raised), 0.0))
        level = _about(self._left, self._elevation)
        rise = np.array(
            [
                [0.0, 0.0, 0.0, 1.0],
                multiply(_about(self._front, -sway), up),
                multiply(_about(self._front, -_HEAD * sway), level),
            ]
        )
        return Bearing(_BEARS, rise)

    def _stands(self, joints: Array) -> float:
        """How much of a performer stands: 0 crouched or sitting, 1 upright."""
        if not self._hips or not self._height > 0.0:
            return 1.0
        share = self._above_feet(joints) / self._height
        return float(np.interp(share, (_CROUCHED, _STANDING), (0.0, 1.0)))

    def _above_feet(self, joints: Array) -> float:
        """The height [m] of the hips above the lower foot."""
        if not self._hips:
            return 0.0
        return float(joints[self._hips, 1].mean() - joints[self._feet, 1].min())


def is_serpent(bodies: TwoBodies, vertices: Array) -> bool:
    """Whether a body has no limbs, lies on the floor and is slender.

    Args:
        bodies: the performer and the character.
        vertices: (C, 3) [m] of the character's surface at rest.
    """
    plan, tree = bodies.plan, bodies.tree
    if plan.arms or plan.legs or not plan.tail or not plan.head:
        return False
    whole = (*plan.tail[::-1], *plan.trunk[1:], *plan.head[1:])
    height = float(np.ptp(vertices[:, 1]))
    return tree.length(whole) > _SLENDER * height


def _elevation(near: Array, far: Array) -> float:
    """The angle [rad] of the way from one point to another above the floor."""
    x, y, z = far - near
    return float(np.arctan2(y, np.hypot(x, z)))


def _about(axis: Array, angle: float) -> Array:
    """The rotation (4,) about a unit axis."""
    return np.append(np.sin(0.5 * angle) * axis, np.cos(0.5 * angle))
