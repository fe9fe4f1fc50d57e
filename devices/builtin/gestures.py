"""The built-in performance: what the puppet body does, as gestures on its joints.

A gesture turns one joint. It eases in and out with continuous acceleration, draws back a little
before it starts and swings a little past where it stops; what lies further out on a limb follows
later. An act is a list of gestures that begins and ends at rest, so that it loops and so that acts
can be strung together into the show.

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
"""Frames a second."""


@dataclass(frozen=True, slots=True)
class Gesture:
    """A turn of one joint, against its parent.

    Attributes:
        joint: which one.
        turn: rotation vector (3,) [rad] in the rest pose's axes, at full swing.
        begin, end: when it leaves rest and when it starts back [s].
        ease: how long it takes to get there, and back again [s].
        frequency: how often it swings to and fro in between [Hz]; 0 holds it there.
        phase: of the swing [rad].
        lift: 1 where it only swings one way, between rest and full swing, like a leg that steps;
            0 where it swings to both sides.
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
    """Gestures over `seconds`, from rest to rest."""

    seconds: float
    gestures: tuple[Gesture, ...]


@dataclass(frozen=True, slots=True, eq=False)
class MotionClip:
    """An act played by the puppet body, one loop of it.

    Attributes:
        skeleton: of all frames.
        times: (T,) [s] from 0, evenly spaced; the frame after the last is the first.
        positions: (T, J, 3) [m].
        rotations: (T, J, 4) quaternions (x, y, z, w), joint to world, identity at rest.
    """

    skeleton: Skeleton
    times: Array
    positions: Array
    rotations: Array


def smooth_step(x: Array) -> Array:
    """From 0 at x = 0 to 1 at x = 1, with no velocity or acceleration at either end."""
    x = np.clip(x, 0.0, 1.0)
    step: Array = x**3 * (10.0 + x * (6.0 * x - 15.0))
    return step


def _bump(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    bump: Array = (4.0 * x * (1.0 - x)) ** 3
    return bump


def swing(gesture: Gesture, times: Array) -> Array:
    """How far (T,) the gesture is out at each time: 0 at rest, 1 at full swing."""
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


def sample_motion(act: BuiltinMotion) -> MotionClip:
    """The act as frames: forward kinematics with constant bones, the lowest foot on the floor."""
    skeleton = builtin_skeleton()
    count = round(act.seconds * RATE)
    times = np.arange(count) / RATE
    turns = np.zeros((len(skeleton.names), count, 3))
    for gesture in act.gestures:
        # What a gesture leaves beyond the act's end goes on at its beginning.
        for shift in (-act.seconds, 0.0, act.seconds):
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
    """How far (T,) [m] the lower foot is above its rest; a soft minimum, so no step is felt."""
    feet = [skeleton.index(f"{part}{side}") for part in ("Foot", "Ankle") for side in SIDES]
    raised = positions[:, feet, 1] - skeleton.rest_positions[feet, 1]
    softness = 0.006
    lowest: Array = -softness * np.log(np.exp(-raised / softness).mean(axis=1))
    return lowest
