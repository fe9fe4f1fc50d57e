"""World pose of the 55 humanoid joints from the local poses of the bones that a sender gives.

Senders differ: some give the bone offsets of their model, some give rotations with zero offsets;
models lack optional bones; the bones of VRM 1 need not have identity rotations in the T-pose.
Missing values come from the built-in body, scaled to the sender's size.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.bodies.humanoid import ONWARD, OPTIONAL, SEGMENTS, humanoid_skeleton
from devices.bodies.humanoid_kernels import Axes, Bones, Structure, WorldPose, pose_in_world
from solvers.skeleton.joint_poses import ForwardKinematics
from solvers.skeleton.quaternions import conjugate

Array = NDArray[np.float64]

SKELETON = humanoid_skeleton()
COUNT = len(SKELETON.names)
HIPS = SKELETON.index("Hips")
_REST = SKELETON.rest_positions
_PARENTS = SKELETON.parents
_ORDER = np.array(SKELETON.order)
_IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])
_OPTIONAL = np.array([name in OPTIONAL for name in SKELETON.names])
_ONWARD = {SKELETON.index(bone): SKELETON.index(to) for bone, to in ONWARD.items()}
# A knuckle is rigid with its hand; the directions of the further finger bones cannot be inferred.
_UNKNOWABLE = np.array([name.endswith(SEGMENTS[1:]) for name in SKELETON.names])


@lru_cache(maxsize=64)
def structure_of(received: bytes) -> Structure:
    """Return the structure for a set of received bones, given as the bytes of a (J,) bool mask.

    A sender without hips sends parts of a body: every bone that it omits exists and is at rest. A
    sender with hips omits an optional bone only if its model lacks the bone.
    """
    sent = np.frombuffer(received, dtype=np.bool_)
    absent = _OPTIONAL & ~sent if sent[HIPS] else np.zeros(COUNT, dtype=np.bool_)
    anchors = _PARENTS.copy()
    for joint in SKELETON.order:
        above = anchors[joint]
        if above >= 0 and absent[above]:
            anchors[joint] = anchors[above]
    defaults = _REST - np.where(anchors[:, None] >= 0, _REST[anchors], 0.0)
    lengths = np.linalg.norm(defaults, axis=1)
    along, shares = [], []
    for joint in SKELETON.order:
        if absent[joint] and joint in _ONWARD:
            following = _ONWARD[joint]
            while absent[following] and following in _ONWARD:
                following = _ONWARD[following]
            along.append((joint, following))
            shares.append(min(float(lengths[joint] / lengths[following]), 1.0))
    return Structure(
        _PARENTS,
        _ORDER,
        absent,
        defaults,
        lengths,
        np.array(along, dtype=np.int64).reshape(-1, 2),
        np.array(shares, dtype=np.float64),
        sent | (absent & ~_UNKNOWABLE & sent[anchors]),
    )


class HumanoidPose:
    """The newest local pose of each bone, and the resulting world pose; in our coordinates.

    Attributes:
        bones: the received values; the packet decoder writes them in place.
    """

    def __init__(self) -> None:
        self._numbers = np.zeros(14 * COUNT + 7)  # all bones in one block, fast to compare
        places, turns, pinned_places, pinned_turns, root = np.split(
            self._numbers, np.cumsum([3 * COUNT, 4 * COUNT, 3 * COUNT, 4 * COUNT])
        )
        self.bones = Bones(
            places.reshape(COUNT, 3),
            turns.reshape(COUNT, 4),
            pinned_places.reshape(COUNT, 3),
            pinned_turns.reshape(COUNT, 4),
            root,
            *np.zeros((3, COUNT), dtype=np.bool_),
        )
        self.bones.root[3:] = _IDENTITY
        self._axes = Axes(*np.tile(_IDENTITY, (2, COUNT, 1)))
        self._out = WorldPose(np.empty((COUNT, 3)), np.empty((COUNT, 4)), np.empty(COUNT))
        self.forget()
        self.world()  # compile before the first packet

    def forget(self) -> None:
        """Discard all bones, for example when the sender loads another model."""
        bones = self.bones
        bones.sent[:] = bones.pinned[:] = bones.fresh[:] = False
        bones.positions[:] = 0.0
        bones.rotations[:] = _IDENTITY

    def calibrate(self) -> None:
        """Take the current rotations as the model's T-pose.

        The axes of each bone are then the world axes at rest, as VRM 0 has them and the built-in
        body assumes; the bones of a VRM 1 model may have any rest rotation.
        """
        kinematics = ForwardKinematics(_PARENTS)
        turns = kinematics.world(self.bones.positions, self.bones.rotations)[1]
        upper = turns[_PARENTS]
        upper[HIPS] = _IDENTITY
        self._axes = Axes(upper, conjugate(turns))

    @property
    def content(self) -> bytes:
        """The received values as bytes, for comparison with earlier ones."""
        return self._numbers.tobytes()

    def world(self, *, tracking: bool = True) -> WorldPose:
        """Return the pose of every joint, valid until the next call; `tracking` as in `_judge`."""
        structure = structure_of(self.bones.sent.tobytes())
        pose_in_world(self.bones, structure, self._axes, tracking, self._out)
        return self._out
