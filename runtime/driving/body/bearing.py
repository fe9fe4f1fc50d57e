"""How the trunk of a character is tilted, at rest and as its performer bows.

A body that stands as people do turns as the performer's trunk turns. One that lies close to the
floor has no room for that: a spider that bowed as deep as its performer would stand on its jaws.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.body.body_parts import TwoBodies
from solvers.skeleton.quaternions import conjugate, multiply, rotate

Array = NDArray[np.float64]

_LEVEL = 0.3  # least level share of the axis through both hips, of a body that stands
_BOW = np.radians(60.0)  # as deep as performers bow
_NODS = 0.35  # a head nods at least by this share
_NO_YAW = 1e-6
_LOW = 0.2  # of half its length: a level trunk that can sink by less, as a lizard's, is low
_LOWEST = 5.0  # percentile of the heights of a trunk's surface


@dataclass(frozen=True, slots=True, eq=False)
class Bearing:
    """How the turns of a performer's trunk become those of a character's.

    Attributes:
        shares: (3,) of the tilts of pelvis, chest and head that the character takes; it turns
            about the vertical as far as the performer.
        rise: (3, 4) its own turns from rest while the performer stands upright.
    """

    shares: Array
    rise: Array

    def of(self, trunk: Array) -> Array:
        """Return the character's turns (3, 4) for a performer's (3, 4)."""
        return multiply(_tilted_less(trunk, self.shares), self.rise)


def low_bearing(room: float, half: float) -> Bearing:
    """Return the bearing of a body that can sink by `room` [m] and is 2 x `half` [m] long."""
    share = np.arcsin(min(room / max(half, 1e-9), 1.0)) / _BOW
    shares = np.minimum([share, share, max(share, _NODS)], 1.0)
    return Bearing(shares, np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)))


def levelled(pelvis: Array, sinking: float, left: Array) -> Array:
    """Return the turn (4,) of a pelvis that sinks on one side as the performer's, in leg lengths.

    Hips that are wider would lift one foot off the floor, and the body with the other.

    Args:
        pelvis: (4,) the turn of the performer's pelvis.
        sinking: the share of the sine of its roll that the character's takes.
        left: (3,) unit, the body's left at rest.
    """
    if sinking == 1.0:
        return pelvis
    left = rotate(pelvis, left)
    sine = float(left[1])
    lower = np.arcsin(np.clip(sinking * sine, -1.0, 1.0)) - np.arcsin(np.clip(sine, -1.0, 1.0))
    front = np.array([-left[2], 0.0, left[0]])
    long = float(np.linalg.norm(front))
    if long < _LEVEL:
        return pelvis
    half = 0.5 * lower
    return multiply(np.append(np.sin(half) / long * front, np.cos(half)), pelvis)


def is_low(bodies: TwoBodies, room: float, half: float) -> bool:
    """Whether a trunk is level and near the floor, by what `room_below` says of it."""
    plan, rest = bodies.plan, bodies.tree.positions
    x, y, z = rest[plan.trunk[-1]] - rest[plan.hips]
    return bool(np.hypot(x, z) > abs(y) and room < _LOW * half)


def room_below(bodies: TwoBodies, vertices: Array, owner: NDArray[np.int64]) -> tuple[float, float]:
    """Return how far [m] a trunk can sink onto the floor, and half of its length [m].

    Args:
        bodies: the performer and the character.
        vertices: (C, 3) [m] of the character's surface at rest.
        owner: (C,) the node that each vertex follows most.
    """
    plan, tree = bodies.plan, bodies.tree
    limbs = {
        node
        for pair in (plan.arms, *plan.more_legs, plan.legs)
        for limb in pair.values()
        for node in tree.subtree(limb.chain[0])
    }
    own = vertices[~np.isin(owner, list(limbs))]
    if not len(own):
        return 0.0, 0.0
    low = float(np.percentile(own[:, 1], _LOWEST)) - float(vertices[:, 1].min())
    return max(low, 0.0), 0.5 * float(np.ptp(own[:, [0, 2]], axis=0).max())


def _tilted_less(turns: Array, shares: Array) -> Array:
    """Rotations (n, 4) that turn as far about the vertical, and by shares (n,) of their tilts."""
    yaws = turns * (0.0, 1.0, 0.0, 1.0)
    size = np.linalg.norm(yaws, axis=1, keepdims=True)
    yaws = np.where(size > _NO_YAW, yaws / np.maximum(size, _NO_YAW), (0.0, 0.0, 0.0, 1.0))
    tilts = multiply(conjugate(yaws), turns)
    tilts = np.where(tilts[:, 3:] < 0.0, -tilts, tilts)
    sine = np.linalg.norm(tilts[:, :3], axis=1, keepdims=True)
    half = shares[:, None] * np.arctan2(sine, tilts[:, 3:])
    axis = tilts[:, :3] / np.maximum(sine, 1e-12)
    return multiply(yaws, np.concatenate([np.sin(half) * axis, np.cos(half)], axis=1))
