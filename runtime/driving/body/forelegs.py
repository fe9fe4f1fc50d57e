"""Lets an animal stand and step on its forelegs while its performer's arms hang.

A foreleg that pointed as an arm points would hover above the floor, or lift the chest, as soon as
the arm is not where the foreleg is at rest. So while the arm hangs, the foreleg stands as it does
at rest: its foot is flat, at its own height, below the shoulder. It steps as the performer's other
foot does, so that it stays where that stays: the trot of a body on four legs. A foot in the air
hangs. Of a performer on four legs it follows the foreleg of its own side. The higher the performer
lifts the hand, the more the foreleg points as the arm does, as far as a foreleg can. The chest of
who bows stays so high that the forelegs have room.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Limb
from runtime.driving.body.body_parts import Arm, TwoBodies
from runtime.driving.body.foreleg_limits import ForelegLimits
from runtime.driving.body.performer_steps import performer_steps
from runtime.driving.body.rig_builder import LOW
from runtime.driving.body.soles import Soles
from runtime.driving.root_motion import chain_length
from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import Quaternion, Vector, multiply, quaternion, rotate
from solvers.kernels.vector import minus, plus, point, scaled
from solvers.retarget.two_bone_ik import bend
from solvers.surface.skin_weights import Skin

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_LEVEL = 1.0  # of its length along the floor: a trunk that rises by more is upright
_REACH = 0.995  # of its length: a foreleg stands no farther from its shoulder
_SINKS = math.radians(10.0)  # by which the trunk sinks at most for forelegs that do not reach
_LIFTED = (0.4, 0.9)
"""Of an arm's length: a hand this far up leads a foreleg not at all, and fully. Arms that swing in
a walk lift the hands less."""
_DEEPEST = 0.5  # of a foreleg's length: a chest that sinks more from rest would crush it
_RISES = math.radians(75.0)  # by which the trunk rises at most for that
_HANGS, _HIGH = math.radians(65.0), 0.12  # a foot this far up, of the foreleg's length, hangs so
_STRAIGHT = math.sin(math.radians(4.5))  # a foreleg that bends by less bends as a knee does
_OFF = 0.03  # of a leg: a foot of the performer that is lower stands
_TURNED = 1e-9  # a rotation of less is none about the vertical
_NOTHING = 1e-9  # [m]
_SEGMENTS = 3  # upper, lower, foot


class _Legs(NamedTuple):
    """F forelegs at rest.

    Attributes:
        shoulders: (F,) the nodes at which they begin.
        carriers: (F,) the nodes above these.
        upper, lower: (F, 3) [m] from the shoulders to the elbows and to the wrists.
        stands, heights: (F,) [m] of the shoulders and the wrists above the floor.
        axes: (F, 3) about which straight ones bend.
        lengths: (F,) [m]
        left: (3,) the body's left.
    """

    shoulders: Ints
    carriers: Ints
    upper: Array
    lower: Array
    stands: Array
    heights: Array
    axes: Array
    lengths: Array
    left: Array


class Forelegs:
    """The forelegs of a character on four legs; of any other body there are none.

    Args:
        bodies: the performer and the character.
        arms: the character's arms that are driven.
        surface: its vertices (C, 3) [m] at rest, and their skin.
        ratio: the character's way for each metre of the performer's.
    """

    def __init__(
        self,
        bodies: TwoBodies,
        arms: Sequence[Arm],
        surface: tuple[Array, Skin],
        ratio: float,
    ) -> None:
        rest, tree = bodies.tree.positions, bodies.tree
        stands = is_on_four(bodies.plan, rest)
        arms = [
            arm for arm in arms if stands and len(arm.starts) > 1 and arm.wrist != arm.starts[1]
        ]
        self._segments = [np.array(arm.segments, dtype=np.int64) for arm in arms]
        self._starts = [np.array(arm.starts, dtype=np.int64) for arm in arms]
        joints = [(arm.starts[0], arm.starts[1], arm.wrist) for arm in arms]
        places = rest[np.array(joints, dtype=np.int64).reshape(-1, 3)]
        self._root = rest[tree.root]
        hind = [(leg.lower or leg.upper)[-1] for leg in bodies.plan.legs.values() if arms]
        self._soles = Soles(tree, [*(arm.wrist for arm in arms), *hind], *surface)
        self._floor, self._pointing = 0.0, [np.zeros((len(arm.starts), 4)) for arm in arms]
        self._left = left = bodies.left
        upper, lower = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
        bends = np.cross(upper, lower - upper) @ left
        sizes = np.linalg.norm(upper, axis=1) * np.linalg.norm(lower - upper, axis=1)
        like_elbow = float((bends / np.maximum(sizes, _NOTHING)).sum()) < -_STRAIGHT * len(arms)
        self._legs = _Legs(
            shoulders=np.array([arm.starts[0] for arm in arms], dtype=np.int64),
            carriers=np.array([tree.parents[arm.starts[0]] for arm in arms], dtype=np.int64),
            upper=upper,
            lower=lower,
            stands=places[:, 0, 1] - rest[:, 1].min(),
            heights=places[:, 2, 1] - rest[:, 1].min(),
            axes=np.tile(-left if like_elbow else left, (len(arms), 1)),
            lengths=np.array([chain_length(rest, chain) for chain in joints]),
            left=left,
        )
        self._limits = ForelegLimits(bodies, arms)
        self._own = np.array([SIDES.index(arm.side) for arm in arms], dtype=np.int64)
        self._performer = performer_steps(bodies)
        self._ratio = ratio
        self._standing: Array | None = None
        if arms and is_on_four(bodies.source, bodies.upright):
            self._standing = self._hooves(bodies.upright)
        self._shares = np.ones(len(arms))
        self._moves = np.zeros((len(arms), 3))
        self._load(rest)

    def _load(self, rest: Array) -> None:
        """Use the kernels once at rest, so that no frame waits for them."""
        still = np.tile([0.0, 0.0, 0.0, 1.0], (len(rest), 1))
        out = np.empty((len(self._segments), _SEGMENTS, 4))
        legs, moves = self._legs, self._moves
        _plant_all(legs, moves, moves[:, 1], 0.0, rest, still, out)
        _sinks(legs, moves, 0.0, self._shares, self._root, rest, still)

    def follow(self, joints: Array, heights: Array) -> bool:
        """Take in a frame; return whether there are forelegs.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
            heights: (F,) [m] of the performer's feet above the floor.
        """
        if not len(self._segments):
            return False
        if self._standing is not None:
            moves = self._hooves(joints) - self._standing
            lifted = moves[self._own, 1] / self._performer.arm
            self._moves = self._ratio * moves[self._own]
        else:
            lifted = np.array([self._performer.of_hand(side, joints)[1] for side in self._own])
            self._moves = self._steps(joints, heights)
        share = np.clip((lifted - _LIFTED[0]) / (_LIFTED[1] - _LIFTED[0]), 0.0, 1.0)
        self._shares = share * share * (3.0 - 2.0 * share)
        self._moves[:, 1] = np.maximum(self._moves[:, 1], 0.0)
        return True

    def sinks(self, positions: Array, rotations: Array) -> float:
        """Return the angle [rad] by which the trunk sinks until forelegs that stand reach down.

        It is negative where the trunk has to rise so that forelegs have room.

        Args:
            positions: (K, 3) [m] of the nodes; the forelegs point as the arms do.
            rotations: (K, 4) of the nodes.
        """
        count = len(self._segments)
        self._pointing = [
            self._limits.held(leg, rotations[self._legs.carriers[leg]], rotations[starts])
            for leg, starts in enumerate(self._starts)
        ]
        self._floor = float(self._soles.heights(positions, rotations)[count:].min())
        return _sinks(
            self._legs,
            self._moves,
            self._floor,
            self._shares,
            self._root,
            positions,
            rotations,
        )

    def plant(self, positions: Array, rotations: Array, given: Array) -> None:
        """Put the rotations of forelegs that all stand into `given` (S, 4), those of all segments.

        Args:
            positions: (K, 3) [m] of the nodes.
            rotations: (K, 4) of the nodes.
            given: is changed.
        """
        self._plant(positions, rotations, self._moves, given)

    def stand(self, positions: Array, rotations: Array, given: Array) -> None:
        """Put the rotations of forelegs that stand with their soles on the floor into `given`.

        Args:
            positions, rotations: of the nodes, as `plant` has them.
            given: (S, 4) is changed.
        """
        count = len(self._segments)
        lows = self._soles.heights(positions, rotations)
        self._floor = float(lows[count:].min())
        moves = self._moves.copy()
        moves[:, 1] += self._floor + self._soles.at_rest[:count] + moves[:, 1] - lows[:count]
        self._plant(positions, rotations, moves, given)
        for leg, segments in enumerate(self._segments):
            share = float(self._shares[leg])
            given[segments] = _between(given[segments], self._pointing[leg], share)

    def _plant(self, positions: Array, rotations: Array, moves: Array, given: Array) -> None:
        """Let all forelegs stand, their feet moved by (F, 3) [m] from below their shoulders."""
        stood = np.empty((len(self._segments), _SEGMENTS, 4))
        lifts = self._moves[:, 1]
        _plant_all(self._legs, moves, lifts, self._floor, positions, rotations, stood)
        for leg, segments in enumerate(self._segments):
            given[segments] = stood[leg, : len(segments)]

    def _steps(self, joints: Array, heights: Array) -> Array:
        """How far (F, 3) [m] the feet step, and how high, after a performer on two legs."""
        feet = self._performer.of_feet(joints)
        feet[:, 1] = 0.0
        if len(heights) == len(SIDES):
            feet[:, 1] = np.maximum(heights - heights.min() - _OFF * self._performer.leg, 0.0)
        moves = feet[1 - self._own]
        moves += ((feet[self._own] - moves) @ self._left)[:, None] * self._left
        steps: Array = self._ratio * moves
        return steps

    def _hooves(self, joints: Array) -> Array:
        """Where the fore hooves (2, 3) [m] of a performer on four legs are.

        Seen from their shoulders, but in height from the lower hind hoof.
        """
        shoulders, wrists = self._performer.hands.T
        ways: Array = joints[wrists] - joints[shoulders]
        ways[:, 1] = joints[wrists, 1] - joints[self._performer.ankles, 1].min()
        return ways


def is_on_four(plan: BodyPlan, rest: Array) -> bool:
    """Whether a body's trunk is level and its arms stand on the floor.

    Args:
        plan: the parts of the body.
        rest: (K, 3) [m] its nodes at rest.
    """
    if len(plan.legs) < len(SIDES) or len(plan.arms) < len(SIDES):
        return False
    hips, shoulders = (
        np.mean([rest[limb.upper[0]] for limb in limbs.values()], axis=0)
        for limbs in (plan.legs, plan.arms)
    )
    rise, way = shoulders[1] - hips[1], np.hypot(*(shoulders - hips)[[0, 2]])
    low = rest[:, 1].min() + LOW * np.ptp(rest[:, 1])
    stands = all(rest[_end(limb), 1] < low for limb in plan.arms.values())
    return bool(stands and abs(rise) < _LEVEL * way)


def _end(limb: Limb) -> int:
    return limb.segments[-1][-1]


@kernel
def _goal(
    legs: _Legs, leg: int, moves: Array, floor: float, positions: Array, rotations: Array
) -> tuple[Vector, Quaternion]:
    """Where the wrist of a foreleg stands [m], and the turn of its foot about the vertical."""
    carry = quaternion(rotations, legs.carriers[leg])
    size = math.hypot(carry[1], carry[3])
    level = (0.0, 0.0, 0.0, 1.0)
    if size > _TURNED:
        level = (0.0, carry[1] / size, 0.0, carry[3] / size)
    shoulder = point(positions, legs.shoulders[leg])
    way = rotate(level, point(legs.lower, leg))
    x, z = shoulder[0] + way[0] + moves[leg, 0], shoulder[2] + way[2] + moves[leg, 2]
    return (x, floor + legs.heights[leg] + moves[leg, 1], z), level


@kernel
def _plant_all(
    legs: _Legs,
    moves: Array,
    lifts: Array,
    floor: float,
    positions: Array,
    rotations: Array,
    out: Array,
) -> None:
    """Write the rotations (F, 3, 4) of upper and lower segments and feet that stand or hang."""
    left = (legs.left[0], legs.left[1], legs.left[2])
    for leg in range(len(legs.shoulders)):
        goal, level = _goal(legs, leg, moves, floor, positions, rotations)
        high = min(max(lifts[leg] / max(_HIGH * legs.lengths[leg], _NOTHING), 0.0), 1.0)
        half = 0.5 * _HANGS * high * high * (3.0 - 2.0 * high)
        x, y, z = scaled(left, math.sin(half))
        foot = multiply(level, (x, y, z, math.cos(half)))
        carry = quaternion(rotations, legs.carriers[leg])
        shoulder = point(positions, legs.shoulders[leg])
        elbow = plus(shoulder, rotate(carry, point(legs.upper, leg)))
        wrist = plus(shoulder, rotate(carry, point(legs.lower, leg)))
        axis = rotate(carry, point(legs.axes, leg))
        upper, lower = bend(shoulder, elbow, wrist, goal, axis)
        upper, lower = multiply(upper, carry), multiply(lower, carry)
        out[leg, 0, 0], out[leg, 0, 1], out[leg, 0, 2], out[leg, 0, 3] = upper
        out[leg, 1, 0], out[leg, 1, 1], out[leg, 1, 2], out[leg, 1, 3] = lower
        out[leg, 2, 0], out[leg, 2, 1], out[leg, 2, 2], out[leg, 2, 3] = foot


@kernel
def _sinks(
    legs: _Legs,
    moves: Array,
    floor: float,
    shares: Array,
    root: Array,
    positions: Array,
    rotations: Array,
) -> float:
    """The angle [rad] by which the trunk sinks: see `Forelegs.sinks`."""
    sine, rises, free = 0.0, 0.0, _RISES
    for leg in range(len(legs.shoulders)):
        goal, _ = _goal(legs, leg, moves, floor, positions, rotations)
        shoulder = point(positions, legs.shoulders[leg])
        x, y, z = minus(goal, shoulder)
        long = legs.lengths[leg]
        reach = math.sqrt(max((_REACH * long) ** 2 - x * x - z * z, 0.0))
        lever = math.hypot(shoulder[0] - root[0], shoulder[2] - root[2])
        lacks = (1.0 - shares[leg]) * max(-y - reach, 0.0)
        sine = max(sine, lacks / max(lever, _NOTHING))
        above = shoulder[1] - root[1]
        trunk = max(math.hypot(lever, above), _NOTHING)
        slack = max(reach + y, 0.0) + shares[leg] * long
        free = min(free, _rise(above, slack, trunk))
        sunk = max(legs.stands[leg] + floor - shoulder[1], 0.0)
        deep = _DEEPEST * long
        crush = sunk - deep * math.tanh(sunk / deep)
        rises = max(rises, _rise(above, crush, trunk))
    return min(math.asin(min(sine, 1.0)), _SINKS) - min(rises, free)


@kernel
def _rise(above: float, by: float, long: float) -> float:
    """The angle [rad] by which a trunk turns until its end is `by` higher than `above` its root."""
    return math.asin(max(min((above + by) / long, 1.0), -1.0)) - math.asin(above / long)


def _between(first: Array, second: Array, share: float) -> Array:
    """Rotations (n, 4) that go a share of the way from the first ones to the second."""
    near = np.where((first * second).sum(axis=1, keepdims=True) < 0.0, -second, second)
    mixed = first + share * (near - first)
    out: Array = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return out
