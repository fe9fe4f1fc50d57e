"""A performer: the pose of the whole body in each frame, and the rest state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.blend_shapes import Blends, mirrored_blends
from devices.bodies.joint_labels import heading_joints, hips_joint, label_joints
from devices.bodies.joint_names import Kind
from devices.bodies.source_joints import source_joints, source_tree
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.conditioning.conditioner import Conditioner, ConditionerState, warm
from runtime.conditioning.mirror import mirrored, mirrored_rotations
from runtime.conditioning.switches import Conditioning, filled_only
from solvers.retarget.heading import heading, turned
from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

HIGHEST_SOLE = 0.15  # [m] of an ankle; a skeleton whose lowest joint is higher does not stand


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """The pose of a performer at one moment.

    Attributes:
        seen: (J, 3) [m] every joint, never NaN.
        filled: (J,) bool, joints that were not seen or were rejected, and are filled in.
        corrected: (J,) bool, joints that were seen elsewhere: rejected, or seen under the name of
            their partner.
        predicted: (J,) bool, joints at the position predicted for one frame later.
        heading: [rad] about +Y, the turn of the whole body from facing +Z.
        hips: (3,) [m] the hips; the body turns about them.
        sole: [m] height of the lowest joint above the floor while the performer stands.
        mirrored: whether left and right are exchanged.
        scaled: whether lengths are scaled to those of the skeleton's rest pose.
        scale: the factor.
        time: [s] of the frame; NaN where it does not matter.
        performer: the performer's number.
        rotations: (J, 4) joint to world, NaN where unknown; None where the source has none.
        blends: weights of the face's blend shapes by name; None where the source has none.
    """

    seen: Array
    filled: NDArray[np.bool_]
    corrected: NDArray[np.bool_]
    predicted: NDArray[np.bool_]
    heading: float
    hips: Array
    sole: float
    mirrored: bool = False
    scaled: bool = False
    scale: float = 1.0
    time: float = float("nan")
    performer: int = 0
    rotations: Array | None = None
    blends: Blends | None = None

    def facing(self, heading: float) -> Array:
        """Return every joint (J, 3) [m] with the whole body turned to this heading [rad]."""
        return turned(self.seen, heading - self.heading, self.hips)


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """The rest state: the performer's pose that corresponds to the rest pose of the character.

    Attributes:
        positions: (J, 3) [m] every joint.
        heading: [rad] the heading of that pose.
        height: [m] of the hips above the floor while the performer stands.
    """

    positions: Array
    heading: float
    height: float


def rest_state(pose: Pose, heading: float | None = None) -> Rest:
    """Return a pose as a rest state, turned to `heading` [rad]; with its own heading if None."""
    under = pose.heading if heading is None else heading
    height = float(pose.hips[1] - pose.seen[:, 1].min()) + pose.sole
    return Rest(pose.facing(under), under, height)


@dataclass(frozen=True, slots=True, eq=False)
class PerformerState:
    """The memory of a performer: of the conditioning, the newest heading [rad] and pose."""

    conditioner: ConditionerState
    heading: float
    pose: Pose | None


class Performer:
    """Follows one performer from frame to frame.

    Args:
        skeleton: the performer's whole skeleton.
        source: the part that drives.
        conditioning: what is done to the frames first; only filled where None.

    Attributes:
        skeleton: the performer's whole skeleton.
        joints: the joints that may drive a character, as chosen by `source`.
        pose: the newest pose; None before the first frame.

    Raises:
        InputError: `source` names a part or joints that this skeleton does not have.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        source: str = "whole",
        conditioning: Conditioning | None = None,
    ) -> None:
        self.skeleton = skeleton
        self._parents, self.joints = source_tree(skeleton, source_joints(skeleton, source))
        self._pairs = np.array(heading_joints(skeleton), dtype=np.int64).reshape(-1, 2)
        self._hips = hips_joint(skeleton)
        self._parts = label_joints(skeleton)
        self._conditioner = Conditioner(skeleton, conditioning or filled_only())
        self._sole = float(np.clip(skeleton.rest_positions[:, 1].min(), 0.0, HIGHEST_SOLE))
        self._heading = 0.0
        self.pose: Pose | None = None
        warm(skeleton)
        heading(skeleton.rest_positions.copy(), self._pairs)

    def follow(self, frame: SkeletonFrame) -> Pose:
        """Take in one frame and return its pose, which is now the newest."""
        whole = self._conditioner.condition(frame)
        positions = whole.positions
        self._heading = heading(positions, self._pairs, self._heading)
        self.pose = Pose(
            seen=positions,
            filled=whole.filled,
            corrected=whole.corrected,
            predicted=whole.predicted,
            heading=self._heading,
            hips=positions[self._hips],
            sole=self._sole,
            mirrored=whole.mirrored,
            scaled=whole.scaled,
            scale=whole.scale,
            time=frame.time,
            performer=frame.performer,
            rotations=self._rotations(frame, whole.mirrored),
            blends=_blends(frame, whole.mirrored),
        )
        return self.pose

    def _rotations(self, frame: SkeletonFrame, mirror: bool) -> Array | None:
        rotations, conditioner = frame.rotations, self._conditioner
        if rotations is not None and conditioner.switches.level:
            rotations = conditioner.levelling.level_rotations(rotations)
        if rotations is not None and mirror:
            rotations = mirrored_rotations(rotations, conditioner.partner)
        return rotations

    def snapshot(self) -> PerformerState:
        """Return the memory between two frames; poses are immutable and shared."""
        return PerformerState(self._conditioner.snapshot(), self._heading, self.pose)

    def restore(self, state: PerformerState) -> None:
        """Go back to a snapshot of a performer with the same skeleton."""
        self._conditioner.restore(state.conditioner)
        self._heading, self.pose = state.heading, state.pose

    @property
    def mirrors(self) -> bool:
        """Whether left and right are exchanged."""
        return self._conditioner.switches.mirror

    @property
    def calibrates(self) -> bool:
        """Whether the newest pose is a T or A pose that was kept still, to be the rest state."""
        return self._conditioner.calibrates

    def recalibrate(self) -> None:
        """Measure the floor and the performers' sizes anew."""
        self._conditioner.recalibrate()

    def restated(self, rest: Rest, *, mirror: bool, scale: float) -> Rest:
        """Return a rest state mirrored (if `mirror`), and `scale` times as large."""
        positions = rest.positions * scale
        if mirror:
            positions = mirrored(positions, self._conditioner.partner)
        heading = -rest.heading if mirror else rest.heading
        return Rest(positions, heading, rest.height * scale)

    def limb(self, chain: tuple[int, ...]) -> tuple[int, ...]:
        """Return a limb without the bone that joins it to the trunk; two joints at least."""
        for start, joint in enumerate(chain[:-1]):
            part = self._parts[joint]
            if part is not None and part.kind in (Kind.UPPER_ARM, Kind.UPPER_LEG):
                return chain[start:]
        return chain

    def rest_tree(self) -> Tree:
        """Return the chosen joints as a tree, in the rest pose of the skeleton."""
        return Tree(self._parents, self.skeleton.rest_positions[self.joints])


def _blends(frame: SkeletonFrame, mirror: bool) -> Blends | None:
    if frame.blends is None or not mirror:
        return frame.blends
    return mirrored_blends(frame.blends)
