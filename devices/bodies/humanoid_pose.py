"""From the local poses of some bones of a humanoid to where all of its joints are.

Senders differ: some give their model's bone offsets, some only rotations and zeros; models lack
optional bones; bones of VRM 1 need not be at identity in their T-pose. What is missing comes from
the built-in body, scaled to the sender's.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.bodies.forward_kinematics import ForwardKinematics, conjugate
from devices.bodies.humanoid import ONWARD, OPTIONAL, SEGMENTS, humanoid_skeleton
from devices.bodies.humanoid_kernels import Axes, Bones, Structure, WorldPose, pose_in_world

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
# A knuckle is rigid with its hand; where the finger goes from there nobody knows.
_UNKNOWABLE = np.array([name.endswith(SEGMENTS[1:]) for name in SKELETON.names])


@lru_cache(maxsize=64)
def structure_of(received: bytes) -> Structure:
    """The structure for a set of bones, given as the bytes of a (J,) bool mask.

    Without hips a sender gives parts of a body only, and every bone it leaves out is there, at
    rest; with hips, an optional bone left out is one that its model does not have.
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
    """The newest local pose of each bone, and the world pose that they make; in our own space.

    Attributes:
        bones: what was sent, written in place by whoever reads packets.
    """

    def __init__(self) -> None:
        self._numbers = np.zeros(14 * COUNT + 7)  # of all bones; one block, quick to compare
        places, turns, held_places, held_turns, root = np.split(
            self._numbers, np.cumsum([3 * COUNT, 4 * COUNT, 3 * COUNT, 4 * COUNT])
        )
        self.bones = Bones(
            places.reshape(COUNT, 3),
            turns.reshape(COUNT, 4),
            held_places.reshape(COUNT, 3),
            held_turns.reshape(COUNT, 4),
            root,
            *np.zeros((3, COUNT), dtype=np.bool_),
        )
        self.bones.root[3:] = _IDENTITY
        self._axes = Axes(*np.tile(_IDENTITY, (2, COUNT, 1)))
        self._out = WorldPose(np.empty((COUNT, 3)), np.empty((COUNT, 4)), np.empty(COUNT))
        self.forget()
        self.world()  # compiled before the first packet comes

    def forget(self) -> None:
        """Know no bone any more: another model may follow."""
        bones = self.bones
        bones.sent[:] = bones.held[:] = bones.fresh[:] = False
        bones.positions[:] = 0.0
        bones.rotations[:] = _IDENTITY

    def calibrate(self) -> None:
        """Take the present rotations for the model's T-pose.

        Each bone's axes are then those of the world at rest, as VRM 0 has them and the built-in
        body assumes; a VRM 1 model may have bones turned any way.
        """
        kinematics = ForwardKinematics(_PARENTS)
        turns = kinematics.world(self.bones.positions, self.bones.rotations)[1]
        upper = turns[_PARENTS]
        upper[HIPS] = _IDENTITY
        self._axes = Axes(upper, conjugate(turns))

    @property
    def content(self) -> bytes:
        """Everything that was sent, to be compared with what was sent before."""
        return self._numbers.tobytes()

    def world(self, *, tracking: bool = True) -> WorldPose:
        """Where every joint is, until the next call; less sure where the sender tracks badly."""
        structure = structure_of(self.bones.sent.tobytes())
        pose_in_world(self.bones, structure, self._axes, tracking, self._out)
        return self._out
