"""Mends one performer's frames: puts exchanged limbs right and rejects impossible joints.

Both steps compare a joint with its place and velocity when it was last accepted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.fill import was_seen
from runtime.conditioning.body_anatomy import BodyAnatomy
from solvers.kernels.compiled import kernel
from solvers.kernels.short_loops import put
from solvers.signal.continuity import LEAST_WRONG, distance, exchanged, expect

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]
Record = Any  # one record, which numba writes through

FORGET = 0.5  # [s] unseen, after which a joint has no expected place
VELOCITY_SECONDS = 0.02  # [s] a velocity is measured over no shorter time than this

INSIST_AT_LEAST, INSIST_AT_MOST = 0.5, 10.0  # [s] of exchanged limbs after which they are accepted

JUMP = 0.1  # [m] from its expected place that a joint may be at once
FASTEST = 6.0  # [m/s] further, for each second since it was accepted
LONGEST_REACH = 0.1  # [s] for which that grows
BELIEVED = 3  # frames after which a joint is known well enough to be rejected
CONFIRMED_SECONDS = 0.12  # [s] in one place after which a rejected joint is accepted there
CONFIRMED_CUT = 2  # frames after which a jump of the whole body is accepted
CUT = 0.6  # share of the seen joints that jump together where the whole body jumps

STRETCHED = 0.47  # change of the logarithm of a bone's length: a factor of 1.6
STRETCHED_BY = 0.12  # [m] least change of a stretched bone's length
BONE_STEP = 0.02  # share of its length by which a bone's usual length adapts each frame
BONES_MEASURED = 10  # frames after which a bone's usual length is known


# Of each joint: its partner on the other side, and its limb. When last accepted: its place, time
# and velocity, and the number of times. While rejected: its place, since when, and the number of
# times. In this frame: its expected place, its distance from there, the distance allowed, and
# whether it was corrected.
_JOINT = np.dtype(
    [
        ("partner", np.int64),
        ("limb", np.int64),
        ("place", np.float64, 3),
        ("velocity", np.float64, 3),
        ("at", np.float64),
        ("times", np.int64),
        ("doubted", np.float64, 3),
        ("doubted_at", np.float64),
        ("doubts", np.int64),
        ("wanted", np.float64, 3),
        ("off", np.float64),
        ("reach", np.float64),
        ("corrected", np.bool_),
    ],
    align=True,
)

# Of each long bone: its ends, its usual length, and the number of measurements.
_BONE = np.dtype(
    [("far", np.int64), ("near", np.int64), ("usual", np.float64), ("measured", np.int64)]
)

# Of each pair of limbs: since when they are exchanged, and since when they were not; NaN: never.
_LIMB = np.dtype([("since", np.float64), ("straight", np.float64)])


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """A frame's joints after its faults are mended.

    Attributes:
        positions: (J, 3) [m]; NaN where not seen or rejected.
        corrected: (J,) bool, the joint was seen, and rejected or exchanged with its partner.
    """

    positions: Array
    corrected: Bools


@dataclass(frozen=True, slots=True, eq=False)
class FaultsState:
    """The memory of one performer's mending: (J,) of `_JOINT`, (B,) of `_BONE`, (L,) of `_LIMB`."""

    joints: Records
    bones: Records
    limbs: Records


class Faults:
    """Mends the frames of one performer.

    Args:
        body: the skeleton's anatomy.
        joints: the skeleton's number of joints.
    """

    def __init__(self, body: BodyAnatomy, joints: int) -> None:
        self._joints = np.zeros(joints, _JOINT)
        self._joints["partner"], self._joints["limb"] = body.partner, body.group
        self._joints["place"] = self._joints["doubted"] = np.nan
        self._joints["at"] = -np.inf
        self._bones = np.zeros(len(body.bones), _BONE)
        self._bones["far"], self._bones["near"] = body.bones, body.near
        self._beyond = body.beyond
        self._limbs = np.full(int(body.group.max(initial=-1)) + 1, np.nan, _LIMB)

    def snapshot(self) -> FaultsState:
        """Return a copy of the memory."""
        return FaultsState(self._joints.copy(), self._bones.copy(), self._limbs.copy())

    def restore(self, state: FaultsState) -> None:
        """Go back to a snapshot."""
        self._joints[:], self._bones[:], self._limbs[:] = state.joints, state.bones, state.limbs

    def mend(self, positions: Array, time: float, *, swaps: bool, outliers: bool) -> Mended:
        """Return the frame with its faults mended.

        Args:
            positions: (J, 3) [m]; NaN where not seen. A place that `replay.fill` counts as not
                seen counts as not seen here, too.
            time: [s].
            swaps: put exchanged limbs right.
            outliers: reject joints that jump, and the ends of stretched bones.

        Raises:
            ValueError: the frame does not have the skeleton's number of joints.
        """
        if positions.shape != (len(self._joints), 3):
            raise ValueError(f"Expected positions {(len(self._joints), 3)}, got {positions.shape}")
        joints, mended = self._joints, positions.copy()
        wrong = _expect(joints, mended, time)
        if swaps and len(self._limbs):
            _put_right(joints, self._limbs, mended, time, wrong)
        if outliers:
            _reject(joints, self._bones, self._beyond, mended, time)
        _believe(joints, mended, time)
        return Mended(mended, joints["corrected"].copy())


@kernel
def _expect(joints: Records, positions: Array, time: float) -> bool:
    """Set each joint's expected place; return whether any is far enough from it to be exchanged."""
    wrong = False
    for index, joint in enumerate(joints):
        gap = time - joint.at
        if not was_seen(positions[index]):
            positions[index] = np.nan
        joint.corrected = False
        joint.wanted[:] = np.nan
        if abs(gap) < FORGET:
            expect(joint.place, joint.velocity, gap, joint.wanted)
        joint.off = distance(positions[index], joint.wanted)
        joint.reach = JUMP + FASTEST * min(max(gap, 0.0), LONGEST_REACH)
        wrong |= joint.off > LEAST_WRONG
    return wrong


@kernel
def _put_right(joints: Records, limbs: Records, positions: Array, time: float, wrong: bool) -> None:
    """Exchange the joints of limbs whose sides are exchanged.

    Limbs that stay exchanged for longer than they were straight before are accepted as they are.
    """
    told = np.zeros(len(limbs), dtype=np.bool_)
    if wrong:  # else no limb can be exchanged
        told = exchanged(positions, joints["wanted"], joints["partner"], joints["limb"])
    insists = np.zeros(len(limbs), dtype=np.bool_)
    for index, limb in enumerate(limbs):
        if told[index]:
            insists[index] = _insists(limb, time)
        else:
            limb.since = np.nan
            limb.straight = time if np.isnan(limb.straight) else limb.straight
    for index, joint in enumerate(joints):
        other = joint.partner
        if joint.limb < 0 or not told[joint.limb]:
            continue
        if insists[joint.limb]:
            joint.at = -np.inf  # forget the limb's motion
        elif index < other:
            for axis in range(3):
                mine = positions[index, axis]
                positions[index, axis] = positions[other, axis]
                positions[other, axis] = mine
            for end in (index, other):
                joints[end].corrected = not np.isnan(positions[end, 0])
                joints[end].off = distance(positions[end], joints[end].wanted)


@kernel
def _insists(limb: Record, time: float) -> bool:
    """Return whether a limb has been exchanged for long enough to be accepted as it is."""
    if np.isnan(limb.since):
        limb.since = time
    before = 0.0 if np.isnan(limb.straight) else limb.since - limb.straight
    if time - limb.since <= min(max(before, INSIST_AT_LEAST), INSIST_AT_MOST):
        return False
    limb.straight, limb.since = time, np.nan
    return True


@kernel
def _reject(joints: Records, bones: Records, beyond: Bools, positions: Array, time: float) -> None:
    """Mark joints as unseen that jump, or whose bones do not have their usual length."""
    stretched = _stretched(joints, bones, beyond, positions)
    seen, far = 0, 0
    for index, joint in enumerate(joints):
        seen += not np.isnan(positions[index, 0])
        far += _jumped(joint)
    cut = far >= CUT * seen
    for index, joint in enumerate(joints):
        jumped = _jumped(joint)
        if jumped:
            confirmed = _confirmed(joint, positions[index], time, cut)
        else:
            confirmed = False
            joint.doubts = 0
        if stretched[index] or (jumped and not confirmed):
            joint.corrected |= not np.isnan(positions[index, 0])
            positions[index] = np.nan


@kernel
def _jumped(joint: Record) -> bool:
    # Never without an expected place: `off` is NaN then.
    return bool(joint.times >= BELIEVED and joint.off > joint.reach)


@kernel
def _confirmed(joint: Record, place: Array, time: float, cut: bool) -> bool:
    """Return whether a rejected joint has stayed in one place for long enough to be accepted."""
    since = max(time - joint.doubted_at, 0.0) if joint.doubts > 0 else 0.0
    still = distance(place, joint.doubted) < JUMP + 2.0 * since
    joint.doubts = joint.doubts + 1 if still else 1
    if joint.doubts == 1:
        joint.doubted_at = time
    put(joint.doubted, place)
    if joint.doubts < CONFIRMED_CUT:
        return False
    return cut or bool(time - joint.doubted_at >= CONFIRMED_SECONDS)


@kernel
def _stretched(joints: Records, bones: Records, beyond: Bools, positions: Array) -> Bools:
    """Which joints (J,) are the less expected ends of bones without their usual length.

    The joints beyond such an end moved along with it, unless the next bone is stretched at this
    end, too.
    """
    near, far = np.zeros(len(joints), dtype=np.bool_), np.zeros(len(bones), dtype=np.bool_)
    for index, bone in enumerate(bones):
        if _changed(bone, distance(positions[bone.far], positions[bone.near])):
            far[index] = _known(joints[bone.far].off) >= _known(joints[bone.near].off)
            near[bone.near] |= not far[index]
    out = near.copy()
    for index, bone in enumerate(bones):
        if far[index]:
            out[bone.far] = True
            if not near[bone.far]:
                out |= beyond[index]
    return out


@kernel
def _changed(bone: Record, length: float) -> bool:
    """Return whether a bone's length differs from the usual one; adapt the usual one to it.

    A real change is accepted by that after a while, without a confirmation.
    """
    if not 0.0 < length < np.inf:
        return False
    usual = bone.usual if bone.measured > 0 else length
    off = abs(np.log(length / usual)) > STRETCHED and abs(length - usual) > STRETCHED_BY
    judged = off and bone.measured >= BONES_MEASURED
    share = max(BONE_STEP, 1.0 / (bone.measured + 1.0)) * usual
    bone.usual = usual + min(max(length - usual, -share), share)
    bone.measured += 1
    return judged


@kernel
def _known(off: float) -> float:
    return 0.0 if np.isnan(off) else off


@kernel
def _believe(joints: Records, positions: Array, time: float) -> None:
    """Remember the places and velocities of the accepted joints."""
    for index, joint in enumerate(joints):
        place = positions[index]
        if np.isnan(place[0]):
            continue
        gap = time - joint.at
        if abs(gap) < FORGET:
            put(joint.velocity, (place - joint.place) / max(gap, VELOCITY_SECONDS))
            joint.times += 1
        else:
            joint.velocity[:] = 0.0
            joint.times = 1
        put(joint.place, place)
        joint.at = time
