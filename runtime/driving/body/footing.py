"""Keeps the feet of a body that is driven limb by limb planted, flat, and on the floor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.driving.body.body_parts import BodyParts, TwoBodies
from runtime.driving.performer import Pose
from runtime.driving.root_motion import chain_length
from solvers.retarget.clearance import STANDS, clearance
from solvers.retarget.foot_contacts import FootContacts, FootContactsState
from solvers.retarget.foot_lock import FootLock, FootLockState
from solvers.retarget.hip_shift import HipShift, HipShiftState
from solvers.retarget.sole_pitch import ANGLES, SolePitch, SolePitchState, sole_depths
from solvers.retarget.two_bone_ik import two_bone_turns
from solvers.skeleton.quaternions import between, multiply, rotate
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]
Place = Callable[[Array], Array]
"""Takes points (..., 3) [m] from one space to another."""

_SHORT, _FOOT = 0.02, 0.25  # of the leg: a foot without length, and the length it is given
_LEADS = 0.5  # of its length: a foot that leads less far forward or aside, or back, is a stump
_LIES = 0.5  # sine of the angle below the horizon: a shin that leads down by less lies
_STRAIGHT = 0.8  # cosine between a shin and a foot that goes straight on
_STILL = 1e-6  # [m] a foot that is off by less is in its place


@dataclass(frozen=True, slots=True, eq=False)
class FootingState:
    """The states of the parts of a `Footing` between two frames.

    Attributes:
        contacts, shift, lock, soles: of the parts.
        stood: (2,) [m] heights of hips and shoulders when a foot stood last; NaN before.
    """

    contacts: FootContactsState
    shift: HipShiftState
    lock: FootLockState
    soles: SolePitchState
    stood: Array


class Footing:
    """The feet of a character with F legs that are driven.

    Args:
        bodies: the performer and the character.
        parts: their corresponding parts.
        vertices: (C, 3) [m] of the character's surface at rest.
        owner: (C,) the node that each vertex follows most.
    """

    def __init__(
        self,
        bodies: TwoBodies,
        parts: BodyParts,
        vertices: Array,
        owner: NDArray[np.int64],
    ) -> None:
        rest, nodes = bodies.performer.rest_positions, bodies.tree.positions
        self._legs = legs = parts.legs
        own = {joint for leg in legs for joint in leg.source[2:]}
        body = {joint for part in parts.parts for joint in part.source} - own
        self._body = np.array(sorted(body), dtype=np.int64)
        hips = np.array([leg.source[0] for leg in legs], dtype=np.int64)
        shoulders = parts.trunk.shoulders[parts.trunk.shoulders >= 0]
        self._heights_of = hips, shoulders if len(shoulders) else hips
        self._stood = np.full(2, np.nan)
        self._parts = np.array([leg.source[2:] for leg in legs], dtype=np.int64).reshape(-1, 2)
        self._has_toes = np.array([leg.source[2] != leg.source[3] for leg in legs], dtype=np.bool_)
        self._joints = np.array([leg.target[:3] for leg in legs], dtype=np.int64).reshape(-1, 3)
        self._points = np.array([leg.target[2:] for leg in legs], dtype=np.int64).reshape(-1, 2)
        self._segments = np.array([leg.segments for leg in legs], dtype=np.int64).reshape(-1, 3)
        self._stature = float(np.ptp(rest[:, 1]))
        lengths = [chain_length(nodes, leg.target[:3]) for leg in legs]
        theirs = [chain_length(rest, leg.source[:3]) for leg in legs]
        leg, their_leg = (float(np.mean(each or [1.0])) for each in (lengths, theirs))
        self._contacts = FootContacts(rest[self._parts, 1], their_leg)
        self._shift = HipShift(np.array(lengths))
        self._lock = FootLock(np.array(lengths))
        ours = nodes[self._points[:, 1]] - nodes[self._points[:, 0]]
        front = bodies.front
        self._stands_up = _stands_up(nodes, self._joints, ours)
        lies = self._stands_up[:, 3] < 1.0
        leads = np.array([_leads(way, front, leg) for way in ours], dtype=np.bool_)
        ours[lies | ~leads] = _FOOT * leg * front
        standing = bodies.upright[self._parts[:, 1]] - bodies.upright[self._parts[:, 0]]
        self._ratio = leg / max(their_leg, 1e-9)
        self._depths = np.array(
            [
                sole_depths(rotate(up, _foot_surface(bodies.tree, part, vertices, owner)), way)
                for up, part, way in zip(self._stands_up, self._points, ours, strict=True)
            ]
        ).reshape(-1, len(ANGLES))
        self._soles = SolePitch(
            ours,
            np.where(self._has_toes[:, None], standing, ours),
            self._has_toes,
            self._depths,
        )

    def watch(self, pose: Pose) -> None:
        """Find out which parts of the performer's feet stand."""
        if len(self._legs):
            self._contacts.update(pose.seen[self._parts], pose.time)

    def turn_soles(self, joints: Array, left: Array, time: float, given: Array) -> None:
        """Put the rotations of the feet into `given` (S, 4), those of the segments.

        Args:
            joints: (J, 3) [m] the performer, turned as the character faces.
            left: (3,) the body's left.
            time: [s]
            given: (S, 4) is changed.
        """
        feet = self._segments[:, 2]
        if not len(feet):
            return
        ways = joints[self._parts[:, 1]] - joints[self._parts[:, 0]]
        ways[~self._has_toes] = (-left[2], 0.0, left[0])
        heights, stands = self._contacts.heights[:, 0], self._contacts.stands[:, 0]
        heights = self._ratio * heights
        turns = self._soles.turns(ways, left, heights, stands, time)
        real = feet >= 0
        given[feet[real]] = multiply(turns[real], self._stands_up[real])

    def hip_shift(
        self, pose: Pose, positions: Array, performer_on_stage: Place, on_stage: Place
    ) -> Array:
        """Return how far (2,) [m] along x and z the hips move over the planted feet.

        Args:
            pose: of the performer.
            positions: (K, 3) [m] of the character's nodes.
            performer_on_stage: takes the performer's joints to the stage.
            on_stage: takes the character's nodes to the stage, the hips not shifted.
        """
        if not len(self._legs):
            return np.zeros(2)
        return self._shift.follow(
            on_stage(positions[self._points]),
            performer_on_stage(pose.seen[self._parts]),
            self._contacts.stands,
            pose.time,
        )

    def plant(
        self,
        pose: Pose,
        nodes: tuple[Array, Array],
        left: Array,
        given: Array,
        *,
        performer_on_stage: Place,
        on_stage: Place,
        off_stage: Place,
    ) -> bool:
        """Put the rotations that keep the feet planted into `given` (S, 4).

        Args:
            pose: of the performer.
            nodes: positions (K, 3) [m] and rotations (K, 4) of the character without it.
            left: (3,) the body's left, about which knees bend.
            given: (S, 4) is changed.
            performer_on_stage: takes the performer's joints to the stage.
            on_stage, off_stage: take the character's nodes to the stage, and back.

        Returns:
            Whether any leg has to be bent.
        """
        if not len(self._legs):
            return False
        positions, rotations = nodes
        goals = self._lock.goals(
            on_stage(positions[self._joints[:, 0]]),
            on_stage(positions[self._points]),
            performer_on_stage(pose.seen[self._parts]),
            self._contacts.stands,
            pose.time,
        )
        if not np.abs(self._lock.offsets).max() > _STILL:
            return False
        axes = np.tile(left, (len(self._legs), 1))
        turns = two_bone_turns(positions[self._joints], off_stage(goals), axes)
        for bone in range(2):
            own = rotations[self._joints[:, bone]]
            given[self._segments[:, bone]] = multiply(turns[:, bone], own)
        return True

    @property
    def heights(self) -> Array:
        """How far (F,) [m] the lower end of each of the performer's feet is above its floor."""
        heights: Array = self._contacts.heights.min(axis=1) if len(self._legs) else np.zeros(0)
        return heights

    @property
    def above(self) -> float:
        """How far [m] the performer's lower foot is above where it stands."""
        return float(self._contacts.heights.min()) if len(self._legs) else 0.0

    def clearance(self, pose: Pose) -> float:
        """How far the character is above the floor [m]; 0 for one whose feet are not known.

        As far as the performer, and no farther than its own feet are.
        """
        if not len(self._legs):
            return 0.0
        heights, floor = self._contacts.heights, float(self._contacts.floors.min())
        trunk = np.array([pose.seen[joints, 1].mean() for joints in self._heights_of])
        if heights.min() <= STANDS * self._stature or np.isnan(self._stood).any():
            self._stood = trunk
        rise = float((trunk - self._stood).min())
        theirs = clearance(heights, pose.seen[self._body], floor, self._stature, rise)
        return max(min(self._ratio * theirs, float(self._soles.above.min())), 0.0)

    def reset(self) -> None:
        """Forget the frames before."""
        self._contacts.reset()
        self._shift.reset()
        self._lock.reset()
        self._soles.reset()
        self._stood = np.full(2, np.nan)

    def snapshot(self) -> FootingState:
        """Return what the next frame depends on."""
        return FootingState(
            self._contacts.snapshot(),
            self._shift.snapshot(),
            self._lock.snapshot(),
            self._soles.snapshot(),
            self._stood,
        )

    def restore(self, state: FootingState) -> None:
        """Go back to a snapshot."""
        self._contacts.restore(state.contacts)
        self._shift.restore(state.shift)
        self._lock.restore(state.lock)
        self._soles.restore(state.soles)
        self._stood = state.stood


def _stands_up(rest: Array, legs: NDArray[np.int64], ways: Array) -> Array:
    """The rotations (F, 4) that put feet on the floor whose legs lie at rest: of toys that sit.

    Such a foot goes straight on from its shin, and its sole is the end of the leg.

    Args:
        rest: (K, 3) [m] the nodes at rest.
        legs: (F, 3) hips, knees and ankles.
        ways: (F, 3) [m] from the ankles to the ends of the feet.
    """
    found = np.tile([0.0, 0.0, 0.0, 1.0], (len(legs), 1))
    for leg, way in enumerate(ways):
        shin = rest[legs[leg, 2]] - rest[legs[leg, 1]]
        both = float(np.linalg.norm(shin) * np.linalg.norm(way))
        lies = -shin[1] < _LIES * float(np.linalg.norm(shin))
        if lies and shin @ way > _STRAIGHT * both > 0.0:
            found[leg] = between(shin / np.linalg.norm(shin), np.array([0.0, -1.0, 0.0]))
    return found


def _leads(way: Array, front: Array, leg: float) -> bool:
    """Whether the line of a foot says where its toes are.

    That of a stump, such as an elephant's, leads down to some point of its sole.

    Args:
        way: (3,) [m] from the ankle to the end of the line.
        front: (3,) unit, where the body looks.
        leg: [m] length of the leg.
    """
    length = float(np.linalg.norm(way))
    return bool(
        length > _SHORT * leg and np.hypot(way[0], way[2]) > _LEADS * length and way @ front > 0.0
    )


def _foot_surface(
    tree: Tree, part: NDArray[np.int64], vertices: Array, owner: NDArray[np.int64]
) -> Array:
    """The points (n, 3) [m] of a foot's surface and of its nodes at rest, from the ankle."""
    own = tree.subtree(int(part[0]))
    points = np.concatenate([vertices[np.isin(owner, own)], tree.positions[list(own)]])
    surface: Array = points - tree.positions[part[0]]
    return surface
