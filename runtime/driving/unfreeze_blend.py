"""Blends characters that were frozen to the pose of their performer, so that they do not jump.

A gap in the frames, as in a recording that leaves out who was not seen, counts as a freeze.
The blend changes the pose that the puppets follow, after conditioning. Matching, publishing and
filters see the performer's own pose. Each bone turns the short way in the body's own frame, and so
does the heading of the whole, so that no limb collapses: halfway between an arm that was up and an
arm that is down lies an arm that is stretched out, not a point. The rotations of joints turn the
same way, so that heads and hands ease too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.bodies.joint_labels import hips_joint
from devices.skeleton import Skeleton
from runtime.driving.performer import Pose, Rest
from solvers.retarget.heading import turned

Array = NDArray[np.float64]

SECONDS = 0.3
LONGEST_STEP = 0.1  # [s] that a frame counts for at most: a performer lost meanwhile goes on there
GAP = 0.5  # [s] without a frame that count as a freeze, if they are also
UNUSUAL = 5.0  # times as long as the step before
PARALLEL = 1e-9  # sine below which two bones have no axis between them
FRONT, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class _Offset:
    """How far the frozen pose was from the performer's when the characters were let go.

    Attributes:
        turns: (J, 3) [rad] rotation vectors from each joint's bone to the bone shown, in the
            body's frame.
        lengths: (J, 3) [m] the difference that remains after the turn.
        rotations: (J, 3) [rad] rotation vectors from each joint's rotation to the rotation shown,
            in the body's frame; zero where one is unknown.
        heading: [rad] in [-pi, pi).
        hips: (3,) [m].
    """

    turns: Array
    lengths: Array
    rotations: Array
    heading: float
    hips: Array


@dataclass(frozen=True, slots=True, eq=False)
class UnfreezeBlendState:
    """The state of an `UnfreezeBlend` between two frames.

    Attributes:
        shown: the last pose that the puppets followed.
        rests: of each puppet the performer's rest state.
        offset: what is left of the way; None at its end.
        frozen: whether the characters are frozen.
        at: [s] of the last frame.
        passed: [s] since the characters were let go.
        stood: [s] for which they were frozen in all.
        step: [s] between the two last frames.
    """

    shown: Pose | None
    rests: tuple[Rest | None, ...]
    offset: _Offset | None
    frozen: bool
    at: float
    passed: float
    stood: float
    step: float


class UnfreezeBlend:
    """Blends from the pose in which characters were frozen to the pose of their performer.

    Args:
        skeleton: of every pose.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self._order = [joint for joint in skeleton.order if skeleton.parents[joint] >= 0]
        self._parents = np.where(
            skeleton.parents < 0, np.arange(len(skeleton.parents)), skeleton.parents
        )
        self._hips = hips_joint(skeleton)
        self._shown: Pose | None = None
        self._rests: Sequence[Rest | None] = ()
        self._offset: _Offset | None = None
        self._frozen = False
        self._at, self._passed, self._stood, self._step = -np.inf, 0.0, 0.0, np.inf

    def snapshot(self) -> UnfreezeBlendState:
        """Return what is remembered between frames."""
        return UnfreezeBlendState(
            self._shown,
            tuple(self._rests),
            self._offset,
            self._frozen,
            self._at,
            self._passed,
            self._stood,
            self._step,
        )

    def restore(self, state: UnfreezeBlendState) -> None:
        """Go back to a snapshot."""
        self._shown, self._rests, self._offset = state.shown, state.rests, state.offset
        self._frozen, self._at = state.frozen, state.at
        self._passed, self._stood, self._step = state.passed, state.stood, state.step

    def freeze(self, time: float) -> None:
        """Stay frozen at `time` [s]; the puppets follow nothing."""
        if self._shown is not None:
            self._frozen = True
            self._stood += max(time - self._at, 0.0)
            self._at = time

    def follow(self, pose: Pose, time: float, rests: Sequence[Rest | None]) -> Pose:
        """Return the pose that the puppets follow at `time` [s]; for a moment it is a blend.

        Its time stands still while the characters are frozen, so that springs go on as they were.

        Args:
            pose: the performer's newest.
            time: [s] of the newest frame of the show, of any performer.
            rests: of each puppet the performer's rest state. When one changes, the characters
                stand elsewhere at once, and a blend that goes on ends.
        """
        if not _same(rests, self._rests):
            self._rests, self._frozen, self._offset = rests, False, None
        step = time - self._at
        if self._shown is not None and step > max(GAP, UNUSUAL * self._step):
            self._frozen = True
            self._stood += step - max(self._step, 0.0)
            step = max(self._step, 0.0)
        self._step = step
        if self._frozen and self._shown is not None:
            self._offset, self._passed = self._between(pose, self._shown), 0.0
        self._frozen = False
        if self._offset is not None:
            self._passed += min(max(step, 0.0), LONGEST_STEP)
            pose = self._eased(pose, self._offset)
        self._at, self._shown = time, pose
        return replace(pose, time=pose.time - self._stood) if self._stood > 0.0 else pose

    def _bones(self, pose: Pose) -> Array:
        """The vector (J, 3) [m] from each joint's parent to the joint, the body facing +Z."""
        places = pose.facing(0.0)
        bones: Array = places - places[self._parents]
        return bones

    def _between(self, pose: Pose, shown: Pose) -> _Offset:
        bones, wanted = self._bones(pose), self._bones(shown)
        turns = shortest_turns(bones, wanted)
        return _Offset(
            turns=turns,
            lengths=wanted - Rotation.from_rotvec(turns).apply(bones),
            rotations=_rotations_between(pose, shown),
            heading=(shown.heading - pose.heading + np.pi) % (2.0 * np.pi) - np.pi,
            hips=shown.hips - pose.hips,
        )

    def _eased(self, pose: Pose, offset: _Offset) -> Pose:
        """The pose, moved by what is left of the offset."""
        if self._passed >= SECONDS:
            self._offset = None
            return pose
        left = 1.0 - self._passed / SECONDS
        left *= left * (3.0 - 2.0 * left)
        bones = Rotation.from_rotvec(offset.turns * left).apply(self._bones(pose))
        places = bones + offset.lengths * left
        for joint in self._order:
            places[joint] += places[self._parents[joint]]
        places -= places[self._hips]
        heading, hips = pose.heading + offset.heading * left, pose.hips + offset.hips * left
        seen = turned(places, heading, np.zeros(3)) + hips
        rotations = _turned_rotations(pose, offset.rotations * left, heading)
        return replace(pose, seen=seen, heading=heading, hips=hips, rotations=rotations)


def shortest_turns(bones: Array, wanted: Array) -> Array:
    """Return rotation vectors (n, 3) [rad] of the shortest turns from directions to others.

    Opposite directions, which have no shortest turn, turn through the front (+Z); those along +Z
    or -Z turn over the top (+Y). A vector without length is not turned.

    Args:
        bones: (n, 3) any length.
        wanted: (n, 3) any length.
    """
    axes, cosines = np.cross(bones, wanted), (bones * wanted).sum(axis=1)
    sines = np.linalg.norm(axes, axis=1)
    angles = np.arctan2(sines, cosines)
    least = PARALLEL * np.linalg.norm(bones, axis=1) * np.linalg.norm(wanted, axis=1)
    for way in (FRONT, UP):
        opposite = (np.linalg.norm(axes, axis=1) <= least) & (cosines < 0.0)
        axes[opposite] = np.cross(bones[opposite], way)
    lengths = np.linalg.norm(axes, axis=1)
    shares = np.divide(angles, lengths, out=np.zeros(len(axes)), where=lengths > least)
    turns: Array = axes * shares[:, None]
    return turns


def _rotations_between(pose: Pose, shown: Pose) -> Array:
    """Rotation vectors (J, 3) [rad] from the rotations of a pose to those shown, facing +Z."""
    turns = np.zeros((len(pose.seen), 3))
    if pose.rotations is not None and shown.rotations is not None:
        known = np.isfinite(pose.rotations + shown.rotations).all(axis=1)
        if known.any():
            own, wanted = (
                _about_vertical(-each.heading) * Rotation.from_quat(rotations[known])
                for each, rotations in ((pose, pose.rotations), (shown, shown.rotations))
            )
            turns[known] = (wanted * own.inv()).as_rotvec()
    return turns


def _turned_rotations(pose: Pose, turns: Array, heading: float) -> Array | None:
    """The rotations (J, 4) of a pose after turns (J, 3) [rad] in its frame, at another heading."""
    if pose.rotations is None:
        return None
    out = pose.rotations.copy()
    known = np.isfinite(out).all(axis=1)
    if known.any():
        own = _about_vertical(-pose.heading) * Rotation.from_quat(out[known])
        turned_on = Rotation.from_rotvec(turns[known]) * own
        out[known] = (_about_vertical(heading) * turned_on).as_quat()
    return out


def _about_vertical(angle: float) -> Rotation:
    return Rotation.from_rotvec([0.0, angle, 0.0])


def _same(rests: Sequence[Rest | None], before: Sequence[Rest | None]) -> bool:
    return len(rests) == len(before) and all(a is b for a, b in zip(rests, before, strict=True))
