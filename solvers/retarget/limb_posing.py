"""Poses a body so that each of its limbs points where that limb of another body points.

Each segment of a limb takes the smallest rotation from where the segment before has carried it to
the direction of the performer's. So the pose does not depend on the rest pose of either body. Where
a hand shows which way its palm looks, it takes that orientation whole, and the forearm takes half
of the twist between them, as radius and ulna do.

The smallest rotation is not defined where a limb points opposite to where it is carried, and near
there a tremble of the performer's limb would roll the character's by half a turn. So a segment
rolls at most twice as far as it swings. What is left follows the more slowly the nearer the limb is
to that place: see `LimbPoser`.

This is absolute retargeting, as in the tools that animators use; the four papers have no section
for it. `runtime.driving.body.body_driver` says which segments correspond.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import (
    Quaternion,
    Vector,
    between,
    conjugate,
    from_axes,
    is_rotation,
    multiply,
    normalized,
    power,
    quaternion,
    rotate,
)
from solvers.kernels.vector import across, dot, minus, norm, point, scaled, unit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

RIDES: Final = -1
"""Role of a node that keeps to the node above it."""
BLENDS: Final = -2
"""Role of a node of the trunk or neck, between pelvis, chest and head."""

_NOTHING: Final = 1e-9  # a length or share below which there is no direction
_MOST_TWIST: Final = math.radians(270.0)  # of a forearm, before it takes the short way round
ROLLS: Final = 2.0  # times as far as it swings a segment may roll at once
SECONDS: Final = 0.1  # [s] in which a segment that points across its own direction rolls on
LONGEST: Final = 0.25  # [s] between two frames: after a longer gap all is new


class LimbRig(NamedTuple):
    """K nodes of a body, and the S segments of its limbs with the joints that they follow.

    Attributes:
        order: (K,) the nodes, parents first.
        parents: (K,) the node above each; -1 at the root, which stays in place.
        rest: (K, 3) [m] the nodes at rest.
        role: (K,) what turns each node: a segment from 0 on, `RIDES`, or `BLENDS`.
        share: (K,) of a node that blends: 0 the pelvis, 1 the chest, 2 the head.
        near, far: (S,) joints of the performer between which each segment points.
        across: (S, 2) joints from one side of a hand to the other, -1 for none.
        along: (S, 3) unit direction that each segment has at rest.
        frame: (S, 4) orientation of each hand at rest: z along it, x across; else unused.
        is_free: (S,) whether it turns from rest, whatever carries it, as a foot does.
        twisted_by: (S,) the segment that takes the far end of this one along in its twist, or -1.
    """

    order: Ints
    parents: Ints
    rest: Array
    role: Ints
    share: Array
    near: Ints
    far: Ints
    across: Ints
    along: Array
    frame: Array
    is_free: NDArray[np.bool_]
    twisted_by: Ints


def hand_frame(points: Array, near: int, far: int, across: tuple[int, int]) -> Array:
    """Return the orientation (4,) of a hand: z from `near` to `far`, x across it.

    Args:
        points: (n, 3) [m].
        near: index of the wrist.
        far: index of a point farther out.
        across: indices of the two sides, the first on the side of the index finger.
    """
    return np.array(_hand_frame(np.ascontiguousarray(points), near, far, across[0], across[1]))


class _Memory(NamedTuple):
    """What is kept of the limbs between frames.

    Attributes:
        twists: (S,) [rad] of the forearms.
        before: (S, 4) how each segment was turned against what carries it, in the frame before;
            zero where nothing is known.
        now: (S, 4) the same of this frame.
        dt: (1,) [s] since the frame before.
    """

    twists: Array
    before: Array
    now: Array
    dt: Array


@dataclass(frozen=True, slots=True, eq=False)
class LimbPoserState:
    """The memory of a `LimbPoser`: (S,) twists, (S, 4) turns, and the newest time [s] or NaN."""

    twists: Array
    turns: Array
    time: float


class LimbPoser:
    """Poses a body frame after frame.

    Args:
        rig: the body.
    """

    def __init__(self, rig: LimbRig) -> None:
        self._rig = rig
        count = len(rig.near)
        turns = np.zeros((count, 4)), np.zeros((count, 4))
        self._memory = _Memory(np.zeros(count), *turns, np.zeros(1))
        self._time = math.nan

    def reset(self) -> None:
        """Forget all frames."""
        self._memory.twists[:], self._memory.now[:] = 0.0, 0.0
        self._time = math.nan

    def snapshot(self) -> LimbPoserState:
        """Return a copy of what the next frame depends on."""
        return LimbPoserState(self._memory.twists.copy(), self._memory.now.copy(), self._time)

    def restore(self, state: LimbPoserState) -> None:
        """Go back to a snapshot of as many segments."""
        self._memory.twists[:], self._memory.now[:] = state.twists, state.turns
        self._time = state.time

    def begin(self, time: float) -> None:
        """Begin a frame, which may be posed several times.

        Args:
            time: [s]. If it steps back or leaps ahead, or is NaN, all turns are new.
        """
        dt, self._time = time - self._time, time
        self._memory.before[:] = self._memory.now if 0.0 <= dt <= LONGEST else 0.0
        self._memory.now[:] = 0.0
        self._memory.dt[0] = dt

    def pose(
        self, joints: Array, trunk: Array, given: Array, rotations: Array, positions: Array
    ) -> None:
        """Pose the nodes.

        Args:
            joints: (J, 3) [m] the performer's joints, turned so that both bodies face alike.
            trunk: (3, 4) world rotations from rest of pelvis, chest and head.
            given: (S, 4) world rotations from rest of segments; zero where the joints decide.
            rotations: (K, 4) world rotations from rest of the nodes; overwritten.
            positions: (K, 3) [m] of the nodes; overwritten.
        """
        _pose(self._rig, joints, trunk, given, self._memory, rotations, positions)


@kernel
def _pose(
    rig: LimbRig,
    joints: Array,
    trunk: Array,
    given: Array,
    memory: _Memory,
    rotations: Array,
    positions: Array,
) -> None:
    count = len(rig.near)
    twists = memory.twists
    turns = np.zeros((count, 4))
    for step in range(len(rig.order)):
        node = rig.order[step]
        parent = rig.parents[node]
        above = (0.0, 0.0, 0.0, 1.0)
        if parent < 0:
            for k in range(3):
                positions[node, k] = rig.rest[node, k]
        else:
            above = quaternion(rotations, parent)
            offset = rotate(above, minus(point(rig.rest, node), point(rig.rest, parent)))
            for k in range(3):
                positions[node, k] = positions[parent, k] + offset[k]
        turn = above
        role = rig.role[node]
        if role == BLENDS:
            turn = _blend(trunk, rig.share[node])
        elif role >= 0:
            turn = quaternion(turns, role)
            if not is_rotation(turn):
                turn = _turn(rig, role, joints, given, above)
                if not is_rotation(quaternion(given, role)) and not rig.is_free[role]:
                    turn = _rolled(turn, point(rig.along, role), above, memory, role)
                end = rig.twisted_by[role]
                if end >= 0:
                    twists[role] = _twist(rig, role, end, joints, given, turn, twists[role])
                    half = 0.25 * twists[role]  # half of the twist, and half an angle
                    x, y, z = scaled(point(rig.along, role), math.sin(half))
                    turn = multiply(turn, (x, y, z, math.cos(half)))
                turns[role, 0], turns[role, 1], turns[role, 2], turns[role, 3] = turn
        rotations[node, 0], rotations[node, 1], rotations[node, 2], rotations[node, 3] = turn


@kernel
def _blend(trunk: Array, share: float) -> Quaternion:
    """The rotation between pelvis (0), chest (1) and head (2)."""
    below = min(int(share), 1)
    first, second = quaternion(trunk, below), quaternion(trunk, below + 1)
    gap = multiply(conjugate(first), second)
    if gap[3] < 0.0:
        gap = (-gap[0], -gap[1], -gap[2], -gap[3])
    return normalized(multiply(first, power(gap, share - below)))


@kernel
def _turn(rig: LimbRig, s: int, joints: Array, given: Array, above: Quaternion) -> Quaternion:
    """The world rotation of a segment from rest; `above` carries it."""
    own = quaternion(given, s)
    if is_rotation(own):
        return own
    near, far = rig.near[s], rig.far[s]
    way = unit(minus(point(joints, far), point(joints, near)), (0.0, 0.0, 0.0))
    if dot(way, way) < 0.5:
        return above
    if rig.across[s, 0] >= 0:
        frame = _hand_frame(joints, near, far, rig.across[s, 0], rig.across[s, 1])
        if is_rotation(frame):
            return normalized(multiply(frame, conjugate(quaternion(rig.frame, s))))
    carry = (0.0, 0.0, 0.0, 1.0) if rig.is_free[s] else above
    carried = rotate(carry, point(rig.along, s))
    swing = between(carried, way, (0.0, 0.0, 1.0))
    return normalized(multiply(swing, carry))


@kernel
def _rolled(
    turn: Quaternion, along: Vector, above: Quaternion, memory: _Memory, s: int
) -> Quaternion:
    """The turn of segment s, rolled about its own direction no faster than it may."""
    last = quaternion(memory.before, s)
    if is_rotation(last):
        way = rotate(turn, along)
        last = multiply(above, last)
        aim = rotate(last, along)
        kept = multiply(between(aim, way, (0.0, 0.0, 1.0)), last)
        gap = multiply(turn, conjugate(kept))
        roll = 2.0 * math.atan2(dot((gap[0], gap[1], gap[2]), way), gap[3])
        roll -= 2.0 * math.pi * math.floor(roll / (2.0 * math.pi) + 0.5)
        at_once = ROLLS * math.acos(min(max(dot(aim, way), -1.0), 1.0)) + _NOTHING
        if abs(roll) > at_once:
            cosine = dot(rotate(above, along), way)
            far = math.sqrt(max(1.0 - cosine, _NOTHING) / max(1.0 + cosine, _NOTHING))
            left = (abs(roll) - at_once) * math.exp(-memory.dt[0] / (SECONDS * far))
            x, y, z = scaled(way, -math.sin(0.5 * math.copysign(left, roll)))
            turn = normalized(multiply((x, y, z, math.cos(0.5 * left)), turn))
    own = multiply(conjugate(above), turn)
    for k in range(4):
        memory.now[s, k] = own[k]
    return turn


@kernel
def _twist(
    rig: LimbRig,
    s: int,
    end: int,
    joints: Array,
    given: Array,
    turn: Quaternion,
    before: float,
) -> float:
    """The angle [rad] by which segment `end` is twisted against segment s about its axis."""
    beyond = _turn(rig, end, joints, given, turn)
    gap = multiply(conjugate(turn), beyond)
    along = dot((gap[0], gap[1], gap[2]), point(rig.along, s))
    angle = 2.0 * math.atan2(along, gap[3])
    whole = 2.0 * math.pi
    angle += whole * math.floor((before - angle) / whole + 0.5)
    if abs(angle) > _MOST_TWIST:
        angle -= whole * math.floor(angle / whole + 0.5)
    return angle


@kernel
def _hand_frame(points: Array, near: int, far: int, first: int, second: int) -> Quaternion:
    """The orientation of a hand: see `hand_frame`; zero where the points do not define it."""
    zero = (0.0, 0.0, 0.0)
    z = unit(minus(point(points, far), point(points, near)), zero)
    x = unit(across(minus(point(points, second), point(points, first)), z), zero)
    if dot(x, x) < 0.5 or dot(z, z) < 0.5:
        return (0.0, 0.0, 0.0, 0.0)
    return from_axes(x, z)


@kernel
def lift_segments(
    positions: Array,
    rotations: Array,
    segments: Ints,
    joints: Ints,
    share: float,
    aside: Array,
    given: Array,
) -> bool:
    """Leave each segment that points below level a share of its angle; return whether any did.

    Args:
        positions: (K, 3) [m] of the nodes.
        rotations: (K, 4) of the nodes.
        segments: (n,) numbers of the segments, from the shoulder outward.
        joints: (n + 1,) the nodes at their ends.
        share: from 0 to 1.
        aside: (3,) where a segment points if it hangs.
        given: (S, 4) the rotations of the lifted segments are put here.
    """
    lifted = False
    size = math.hypot(aside[0], aside[2])
    for at in range(len(segments)):
        way = minus(point(positions, joints[at + 1]), point(positions, joints[at]))
        length = norm(way)
        if length < _NOTHING or way[1] >= 0.0:
            continue
        own = scaled(way, 1.0 / length)
        x, z = own[0], own[2]
        if size > _NOTHING:
            x += own[1] * own[1] / size * aside[0]
            z += own[1] * own[1] / size * aside[2]
        far = math.hypot(x, z)
        if far < _NOTHING:
            continue
        angle = share * math.asin(min(-own[1], 1.0))
        level = math.cos(angle) / far
        goal = (level * x, -math.sin(angle), level * z)
        turn = multiply(between(own, goal, (0.0, 0.0, 1.0)), quaternion(rotations, joints[at]))
        for k in range(4):
            given[segments[at], k] = turn[k]
        lifted = True
    return lifted


@kernel
def point_hands(
    turned: Array,
    change: Array,
    joints: Array,
    near: Ints,
    far: Ints,
    along: Array,
    knuckles: Ints,
    given: Array,
) -> None:
    """Let hands point where the joints say, rolled as rotations say.

    Args:
        turned: (S, 4) rotations of the performer's hands from rest; zero where unknown.
        change: (S, 4) from the character's hand at rest to the performer's.
        joints: (J, 3) [m] the performer, turned as the character faces.
        near, far, along: as of `LimbRig`.
        knuckles: (S, 2) its `across`. Hands whose knuckles are known are let be.
        given: (S, 4) the rotations of the hands are put here.
    """
    for s in range(len(near)):
        own = quaternion(turned, s)
        if knuckles[s, 0] >= 0 or not is_rotation(own):
            continue
        turn = multiply(own, quaternion(change, s))
        way = minus(point(joints, far[s]), point(joints, near[s]))
        length = norm(way)
        if length > 0.0:
            goal = scaled(way, 1.0 / length)
            turn = multiply(between(rotate(turn, point(along, s)), goal, (0.0, 0.0, 1.0)), turn)
        for k in range(4):
            given[s, k] = turn[k]
