"""Bodies over time whose difference from the performer is known: what the tests of likeness use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.bodies.plan_by_names import plan_by_names
from devices.builtin.body import builtin_skeleton
from devices.builtin.motions import motion_clip
from runtime.benchmarks.resemblance.body_track import BodyTrack

Array = NDArray[np.float64]

BODY = builtin_skeleton()
PLAN = plan_by_names(BODY)
FORWARD = np.array([0.0, 0.0, 1.0])


def performer(act: str = "show") -> BodyTrack:
    """The built-in performer in one of its motions."""
    clip = motion_clip(act)
    assert PLAN is not None
    return BodyTrack(clip.times, clip.positions, clip.rotations, PLAN)


def standing(frames: int = 60, rate: float = 30.0) -> BodyTrack:
    """The built-in performer at rest."""
    assert PLAN is not None
    positions = np.repeat(BODY.rest_positions[None], frames, axis=0)
    rotations = np.zeros((frames, len(BODY.names), 4))
    rotations[..., 3] = 1.0
    return BodyTrack(np.arange(frames) / rate, positions, rotations, PLAN)


def moved(body: BodyTrack, by: Array, *joints: str) -> BodyTrack:
    """The same body with joints, all of them by default, moved by (T, 3) or (3,) [m]."""
    positions = body.positions.copy()
    chosen = [BODY.index(name) for name in joints] or list(range(len(BODY.names)))
    positions[:, chosen] += np.broadcast_to(by, (len(positions), 3))[:, None]
    return replace(body, positions=positions)


def turned(body: BodyTrack, joint: str, vectors: Array) -> BodyTrack:
    """The same body with a joint and all that hangs on it turned about the joint.

    Args:
        body: to be turned.
        joint: its name.
        vectors: (T, 3) or (3,) rotation vectors [rad], world.
    """
    turns = Rotation.from_rotvec(np.zeros((len(body.times), 3)) + vectors)
    first = BODY.index(joint)
    positions, rotations = body.positions.copy(), np.array(body.rotations)
    for below in BODY.tree.subtree(first):
        arm = body.positions[:, below] - body.positions[:, first]
        positions[:, below] = body.positions[:, first] + turns.apply(arm)
        rotations[:, below] = (turns * Rotation.from_quat(rotations[:, below])).as_quat()
    return replace(body, positions=positions, rotations=rotations)


def with_other_half(body: BodyTrack, *, is_mirrored: bool) -> BodyTrack:
    """The same body with left and right exchanged: by name only, or as in a mirror."""
    partner = [
        BODY.names.index(name.replace("Left", "#").replace("Right", "Left").replace("#", "Right"))
        for name in BODY.names
    ]
    mirror = np.array([-1.0 if is_mirrored else 1.0, 1.0, 1.0])
    positions = body.positions[:, partner] * mirror
    if not is_mirrored:  # the trunk and the hips stay: only the limbs are exchanged
        return _with_limbs_of(body, positions)
    return replace(body, positions=positions)


def _with_limbs_of(body: BodyTrack, other: Array) -> BodyTrack:
    """The same trunk with limbs that point where another body's point."""
    positions = body.positions.copy()
    for limbs in (body.plan.arms, body.plan.legs):
        for limb in limbs.values():
            first = limb.upper[0]
            for below in BODY.tree.subtree(first):
                positions[:, below] = positions[:, first] + other[:, below] - other[:, first]
    return replace(body, positions=positions)


def wave(frames: int, size: float, turns: float = 2.0) -> Array:
    """A sine (T,) of this size."""
    out: Array = size * np.sin(np.linspace(0.0, 2.0 * np.pi * turns, frames))
    return out
