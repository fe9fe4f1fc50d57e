"""Gestures on single joints, and their conversion to the frames of a built-in motion.

A gesture turns one joint. It starts and stops with continuous acceleration, draws back a little
before it starts and swings a little past its end; joints further out on a limb follow later. A
built-in motion is a list of gestures that begins and ends at rest, so it loops and can be joined
with others.

Source: F. Thomas, O. Johnston, "The Illusion of Life", 1981, chapter 3 (anticipation, follow
through and overlapping action).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.builtin.body import SIDES, builtin_skeleton
from devices.skeleton import Skeleton

Array = NDArray[np.float64]

Turn = tuple[float, float, float]

RATE = 60.0
"""Frames per second."""


@dataclass(frozen=True, slots=True)
class Gesture:
    """A rotation of one joint relative to its parent.

    Attributes:
        joint: name of the joint.
        turn: rotation vector (3,) [rad] in the rest pose's axes, at full swing.
        begin, end: times [s] at which it leaves rest and starts to return.
        ease: duration [s] of the way there, and of the way back.
        frequency: of the oscillation in between [Hz]; 0 keeps it at full swing.
        phase: of the oscillation [rad].
        lift: 1 if it oscillates between rest and full swing, like a leg that steps; 0 if it
            oscillates to both sides.
    """

    joint: str
    turn: Turn
    begin: float
    end: float
    ease: float = 0.6
    frequency: float = 0.0
    phase: float = 0.0
    lift: float = 0.0


@dataclass(frozen=True, slots=True)
class BuiltinMotion:
    """Gestures over `seconds` [s], from rest to rest."""

    seconds: float
    gestures: tuple[Gesture, ...]


@dataclass(frozen=True, slots=True, eq=False)
class MotionClip:
    """One loop of a built-in motion as frames.

    Attributes:
        skeleton: of all frames.
        times: (T,) [s] from 0, evenly spaced; the first frame follows the last.
        positions: (T, J, 3) [m].
        rotations: (T, J, 4) quaternions (x, y, z, w), joint to world, identity at rest.
    """

    skeleton: Skeleton
    times: Array
    positions: Array
    rotations: Array


def smooth_step(x: Array) -> Array:
    """Rise from 0 at x = 0 to 1 at x = 1, with zero velocity and acceleration at both ends."""
    x = np.clip(x, 0.0, 1.0)
    step: Array = x**3 * (10.0 + x * (6.0 * x - 15.0))
    return step


def _bump(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    bump: Array = (4.0 * x * (1.0 - x)) ** 3
    return bump


def swing(gesture: Gesture, times: Array) -> Array:
    """Return the amplitude (T,) of the gesture at each time: 0 at rest, 1 at full swing."""
    window = smooth_step((times - gesture.begin) / gesture.ease) - smooth_step(
        (times - gesture.end) / gesture.ease
    )
    if gesture.frequency == 0.0:
        draw_back = _bump((times - gesture.begin + 0.18) / 0.40)
        swing_past = _bump((times - gesture.begin - 0.75 * gesture.ease) / (0.9 * gesture.ease))
        return window - 0.07 * draw_back + 0.08 * swing_past
    angle = 2.0 * np.pi * gesture.frequency * (times - gesture.begin) + gesture.phase
    to_and_fro = np.sin(angle)
    to_one_side = (0.5 + 0.5 * to_and_fro) ** 2
    out: Array = window * (to_and_fro + gesture.lift * (to_one_side - to_and_fro))
    return out


def sample_motion(motion: BuiltinMotion) -> MotionClip:
    """Return the motion as frames: forward kinematics, constant bones, lower foot on the floor."""
    skeleton = builtin_skeleton()
    count = round(motion.seconds * RATE)
    times = np.arange(count) / RATE
    turns = np.zeros((len(skeleton.names), count, 3))
    for gesture in motion.gestures:
        # The part of a gesture beyond the motion's end continues at its beginning.
        for shift in (-motion.seconds, 0.0, motion.seconds):
            moved = swing(gesture, times - shift)[:, None] * np.array(gesture.turn)
            turns[skeleton.index(gesture.joint)] += moved
    positions, rotations = _forward(skeleton, turns)
    positions[..., 1] -= _floor(skeleton, positions)[:, None]
    return MotionClip(skeleton, times, positions, rotations)


def _forward(skeleton: Skeleton, turns: Array) -> tuple[Array, Array]:
    rest = skeleton.rest_positions
    count = turns.shape[1]
    positions = np.zeros((count, len(rest), 3))
    rotations = np.zeros((count, len(rest), 4))
    for joint in skeleton.order:
        turn, parent = Rotation.from_rotvec(turns[joint]), int(skeleton.parents[joint])
        if parent >= 0:
            above = Rotation.from_quat(rotations[:, parent])
            positions[:, joint] = positions[:, parent] + above.apply(rest[joint] - rest[parent])
            turn = above * turn
        else:
            positions[:, joint] = rest[joint]
        rotations[:, joint] = turn.as_quat()
    return positions, rotations


def _floor(skeleton: Skeleton, positions: Array) -> Array:
    """Height (T,) [m] of the lower foot above its rest; a soft minimum avoids jumps."""
    feet = [skeleton.index(f"{part}{side}") for part in ("Foot", "Ankle") for side in SIDES]
    raised = positions[:, feet, 1] - skeleton.rest_positions[feet, 1]
    softness = 0.006
    lowest: Array = -softness * np.log(np.exp(-raised / softness).mean(axis=1))
    return lowest
