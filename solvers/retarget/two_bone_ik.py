"""Inverse kinematics of two bones: turns thigh and shin so that the ankle reaches its goal.

The triangle of hip, knee and ankle is known by its three sides (law of cosines). The knee stays on
its own side of the limb, and a limb whose ankle need not move is not turned at all. Goals near full
reach are softened by `within_reach`.

Source: for the soft limit A. Nicholls (2009), "Soft IK", without the threshold's effect on limbs
that are straighter than the threshold themselves.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import Quaternion, Vector, between, multiply, normalized, rotate
from solvers.kernels.vector import cross, dot, minus, norm, plus, scaled, unit

Array = NDArray[np.float64]

SOFT = 0.02  # of the limb's length: how far before full reach a limb starts to lag behind its goal
GIVE = 0.015  # of the limb's length: how much nearer a straight limb's goal may be without a bend
NEARLY = 0.95  # of the limb's length: from here on a limb counts as more and more straight
_SENSE = 0.02  # of the limb's length: knees that stand out less bend about the given axis
_NOTHING = 1e-9  # of the limb's length


def two_bone_turns(joints: Array, goals: Array, axes: Array) -> Array:
    """Return the rotations of both bones of L limbs that bring their ankles to their goals.

    A goal out of reach is met in direction; the limb is then straight, or folded as far as it goes.

    Args:
        joints: (L, 3, 3) [m] hip, knee and ankle of each limb (or shoulder, elbow and wrist).
        goals: (L, 3) [m] of the ankles.
        axes: (L, 3) the axis about which a straight limb's lower bone turns when the limb bends (by
            the right-hand rule); for the knees of a body that faces +Z it is +X.

    Returns:
        (L, 2, 4) quaternions, world, of the upper and the lower bone, since `joints`. The lower
        bone starts where the upper one ends then. Finite for joints that coincide.
    """
    out = np.empty((len(joints), 2, 4))
    _turn_all(joints, goals, axes, out)
    return out


@kernel
def _turn_all(joints: Array, goals: Array, axes: Array, out: Array) -> None:
    for i in range(len(joints)):
        upper, lower = bend(
            (joints[i, 0, 0], joints[i, 0, 1], joints[i, 0, 2]),
            (joints[i, 1, 0], joints[i, 1, 1], joints[i, 1, 2]),
            (joints[i, 2, 0], joints[i, 2, 1], joints[i, 2, 2]),
            (goals[i, 0], goals[i, 1], goals[i, 2]),
            (axes[i, 0], axes[i, 1], axes[i, 2]),
        )
        out[i, 0, 0], out[i, 0, 1], out[i, 0, 2], out[i, 0, 3] = upper
        out[i, 1, 0], out[i, 1, 1], out[i, 1, 2], out[i, 1, 3] = lower


@kernel
def bend(
    hip: Vector, knee: Vector, ankle: Vector, goal: Vector, axis: Vector
) -> tuple[Quaternion, Quaternion]:
    """Return the rotations of the upper and the lower bone: see `two_bone_turns`."""
    upper, lower = minus(knee, hip), minus(ankle, knee)
    a, b = norm(upper), norm(lower)
    still = (0.0, 0.0, 0.0, 1.0)
    if min(a, b) <= _NOTHING * (a + b):
        return still, still
    line, wish = minus(ankle, hip), minus(goal, hip)
    before, wanted = norm(line), norm(wish)
    least = _NOTHING * (a + b)
    # A limb that is folded onto its hip points nowhere: its upper bone stands for it.
    along = scaled(line, 1.0 / before) if before > least else scaled(upper, 1.0 / a)
    towards = scaled(wish, 1.0 / wanted) if wanted > least else along
    swing = between(along, towards, axis)
    after = min(max(wanted, abs(a - b)), a + b)
    forth = 0.5 * after
    if after > least:
        forth = 0.5 * (after + (a * a - b * b) / after)
    forth = min(max(forth, -a), a)
    aside = _knee_side(upper, along, axis, swing, towards, a, forth, a + b)
    new_upper = plus(scaled(towards, forth), aside)
    new_lower = minus(scaled(towards, after), new_upper)
    return (
        _turned_to(upper, new_upper, swing, axis),
        _turned_to(lower, new_lower, swing, axis),
    )


@kernel
def _knee_side(
    upper: Vector,
    along: Vector,
    axis: Vector,
    swing: Quaternion,
    towards: Vector,
    length: float,
    forth: float,
    limb: float,
) -> Vector:
    """Where the knee is off the line from hip to goal: on its own side, as far as it has to be."""
    own = rotate(swing, minus(upper, scaled(along, dot(upper, along))))
    stands_out = norm(own)
    far = math.sqrt(max(length * length - forth * forth, 0.0))
    x, y, z = towards
    any_side = unit((0.0, -z, y) if abs(x) < 0.9 else (-z, 0.0, x), (0.0, 0.0, 0.0))
    side = unit(cross(towards, rotate(swing, axis)), any_side)
    side = unit(plus(scaled(own, 1.0 / limb), scaled(side, _SENSE)), unit(own, side))
    # What is added to the knee's own offset goes to that side, so that nothing to add is nothing.
    moved = plus(own, scaled(side, far - stands_out))
    moved = minus(moved, scaled(towards, dot(moved, towards)))
    return scaled(unit(moved, side), far)


@kernel
def _turned_to(old: Vector, new: Vector, swing: Quaternion, axis: Vector) -> Quaternion:
    """The swing, and after it the smallest rotation that takes one bone's direction to another."""
    here = unit(rotate(swing, old), (0.0, 1.0, 0.0))
    return normalized(multiply(between(here, unit(new, here), axis), swing))


@kernel
def within_reach(hip: Vector, ankle: Vector, goal: Vector, length: float) -> Vector:
    """Return a goal that a limb can reach, at the goal's place on the ground wherever possible.

    A limb that gets straight is led there softly: a goal farther off than the limb reaches is
    raised (or lowered, above the hip). Where even the level distance is too far, it comes nearer.
    A goal that is too near for a straight limb is lowered a little: a knee bends by 8 degrees for
    the first hundredth of the limb's length. The limb's own ankle stays as it is.

    Args:
        hip, ankle: [m] the limb before.
        goal: [m] for the ankle.
        length: [m] of both bones together.
    """
    wish = minus(goal, hip)
    own, far = norm(minus(ankle, hip)), norm(wish)
    if far <= own:
        straight = (own / length - NEARLY) / (1.0 - NEARLY)
        steep = wish[1] * wish[1] / max(far * far, _NOTHING)
        give = GIVE * length * min(max(straight, 0.0), 1.0) * steep
        soft = far + give * (1.0 - math.exp((far - own) / max(give, _NOTHING * length)))
    else:
        soft = soft_reach(far, own, length)
    if soft == far:
        return goal
    level = math.sqrt(wish[0] * wish[0] + wish[2] * wish[2])
    if level >= soft:
        share = soft / level
        return (hip[0] + share * wish[0], hip[1], hip[2] + share * wish[2])
    height = math.copysign(math.sqrt(soft * soft - level * level), wish[1])
    return (goal[0], hip[1] + height, goal[2])


@kernel
def soft_reach(wanted: float, own: float, length: float) -> float:
    """Return how far a limb reaches for a goal `wanted` [m] off: smooth, and never its length.

    Args:
        wanted: [m] from hip to goal.
        own: [m] from hip to ankle before: so far it reaches exactly.
        length: [m] of both bones together.
    """
    room = min(SOFT * length, max(length - own, 0.0))
    start = length - room
    if wanted <= start:
        return wanted
    if room <= _NOTHING * length:
        return start
    return start + room * (1.0 - math.exp((start - wanted) / room))
