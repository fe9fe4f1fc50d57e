"""From the local poses of some bones of a humanoid to where all of its joints are.

Senders differ: some give their model's bone offsets, some only rotations and zeros; models lack
optional bones; bones of VRM 1 need not be at identity in their T-pose. What is missing comes from
the built-in body, scaled to the sender's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.forward_kinematics import ForwardKinematics, conjugate, multiply, rotate
from devices.humanoid import ONWARD, OPTIONAL, SEGMENTS, humanoid_skeleton

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

INFERRED = 0.3
"""Confidence of a joint that was not sent but is rigid with a bone that was."""
NO_LENGTH = 1e-4  # [m] below which an offset was not given
LONGEST_BONE = 3.0  # [m]
OUT_OF_PROPORTION = 20.0  # times longer or shorter than the whole body's scale says

SKELETON = humanoid_skeleton()
COUNT = len(SKELETON.names)
HIPS = SKELETON.index("Hips")
_REST = SKELETON.rest_positions
_PARENTS = SKELETON.parents
_OPTIONAL = np.array([name in OPTIONAL for name in SKELETON.names])
_ONWARD = {SKELETON.index(bone): SKELETON.index(to) for bone, to in ONWARD.items()}
# A knuckle is rigid with its hand; where the finger goes from there nobody knows.
_UNKNOWABLE = np.array([name.endswith(SEGMENTS[1:]) for name in SKELETON.names])


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """How a sender's set of bones hangs together.

    Attributes:
        absent: (J,) bool, optional bones that the model does not have.
        anchors: (J,) the joint that each one's offset is from: its nearest ancestor that is not
            absent, -1 for the world.
        defaults: (J, 3) [m] the built-in body's offset from there.
        along: (absent bone, the next bone of the trunk that is there, the share of the way to it).
        seen: (J,) bool, joints whose place is known.
    """

    absent: Mask
    anchors: NDArray[np.int64]
    defaults: Array
    along: tuple[tuple[int, int, float], ...]
    seen: Mask


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
    along = []
    for joint in SKELETON.order:
        if absent[joint] and joint in _ONWARD:
            following = _ONWARD[joint]
            while absent[following] and following in _ONWARD:
                following = _ONWARD[following]
            share = np.linalg.norm(defaults[joint]) / np.linalg.norm(defaults[following])
            along.append((joint, following, min(float(share), 1.0)))
    rigid = absent & ~_UNKNOWABLE & sent[anchors]
    return Structure(absent, anchors, defaults, tuple(along), sent | rigid)


@lru_cache(maxsize=64)
def _kinematics(cut: bytes) -> ForwardKinematics:
    """The humanoid's kinematics with the joints of a (J,) bool mask cut off their parents."""
    return ForwardKinematics(np.where(np.frombuffer(cut, dtype=np.bool_), -1, _PARENTS))


class HumanoidPose:
    """The newest local pose of each bone, and the world pose that they make; in our own space.

    Attributes:
        positions: (J, 3) [m] as sent: offsets from the parent bone; of the hips, from the root.
        rotations: (J, 4) as sent: bone to parent.
        sent: (J,) bool, bones that were ever sent.
        root: position (3,) [m] and rotation (4,) of the model's root in the world.
        held: (J,) bool, joints that a tracker holds: their pose is one in the world.
        held_positions, held_rotations: (J, 3) [m] and (J, 4) of those.
    """

    def __init__(self) -> None:
        self.positions = np.zeros((COUNT, 3))
        self.rotations = np.zeros((COUNT, 4))
        self.root = (np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
        self.sent = np.zeros(COUNT, dtype=np.bool_)
        self.held = np.zeros(COUNT, dtype=np.bool_)
        self.held_positions = np.zeros((COUNT, 3))
        self.held_rotations = np.zeros((COUNT, 4))
        self._rest_turns: Array | None = None
        self.forget()

    def forget(self) -> None:
        """Know no bone any more: another model may follow."""
        self.sent[:] = False
        self.held[:] = False
        self.positions[:] = 0.0
        self.rotations[:] = (0.0, 0.0, 0.0, 1.0)

    def calibrate(self) -> None:
        """Take the present rotations for the model's T-pose.

        Each bone's axes are then those of the world at rest, as VRM 0 has them and the built-in
        body assumes; a VRM 1 model may have bones turned any way.
        """
        turns = ForwardKinematics(_PARENTS).world(self.positions, self.rotations)[1]
        self._rest_turns = turns

    @property
    def content(self) -> bytes:
        """Everything that was sent, to be compared with what was sent before."""
        arrays = (self.positions, self.rotations, self.held_positions, self.held_rotations)
        return b"".join(array.tobytes() for array in (*arrays, *self.root))

    def world(self) -> tuple[Array, Array, Array]:
        """Where every joint is.

        Returns:
            positions (J, 3) [m] and rotations (J, 4) in the world, NaN where unknown; confidence
            (J,): 1 as sent, INFERRED where rigid with what was sent, 0 where unknown.
        """
        structure = structure_of(self.sent.tobytes())
        rotations, given = self._normalised()
        offsets = self._offsets(given, structure)
        root_position, root_turn = self.root
        offsets[HIPS] = root_position + rotate(root_turn, offsets[HIPS])
        rotations[HIPS] = multiply(root_turn, rotations[HIPS])
        offsets[self.held] = self.held_positions[self.held]
        rotations[self.held] = self.held_rotations[self.held]
        positions, turns = _kinematics(self.held.tobytes()).world(offsets, rotations)
        seen = structure.seen | self.held
        positions[~seen] = np.nan
        turns[~seen] = np.nan
        confidence = np.where(self.sent | self.held, 1.0, np.where(seen, INFERRED, 0.0))
        return positions, turns, confidence

    def _normalised(self) -> tuple[Array, Array]:
        """Rotations and offsets as of a model whose bones have the world's axes at rest.

        With R the rest rotation of a bone in the model and P its parent's, a local rotation q
        becomes P q R^-1 and an offset t becomes P t.
        """
        if self._rest_turns is None:
            return self.rotations.copy(), self.positions
        upper = self._rest_turns[_PARENTS]
        upper[HIPS] = (0.0, 0.0, 0.0, 1.0)
        turned = multiply(upper, multiply(self.rotations, conjugate(self._rest_turns)))
        return turned, rotate(upper, self.positions)

    def _offsets(self, given: Array, structure: Structure) -> Array:
        """(J, 3) [m] of each joint from its parent; as sent where that can be, else the default."""
        scale, usable = plausible_offsets(given, structure.defaults, self.sent)
        vectors = np.where(usable[:, None], given, structure.defaults * scale)
        if self.sent[HIPS] and (np.any(given[HIPS]) or usable.any()):
            vectors[HIPS] = given[HIPS]
        for absent, following, share in structure.along:
            vectors[absent] = share * vectors[following]
        hung = structure.absent[_PARENTS] & (_PARENTS >= 0)
        offsets = vectors.copy()
        offsets[hung] -= vectors[_PARENTS[hung]]
        return offsets


def plausible_offsets(given: Array, defaults: Array, sent: Mask) -> tuple[float, Mask]:
    """How large a sender's body is, and which of its bone offsets can be believed.

    Args:
        given, defaults: (J, 3) [m] offsets as sent, and those of the built-in body.
        sent: (J,) bool, bones that were sent.

    Returns:
        the size as a multiple of the built-in body's, 1 where nothing tells; and a (J,) bool mask,
        never with the hips, whose offset is no bone.
    """
    lengths, expected = np.linalg.norm(given, axis=1), np.linalg.norm(defaults, axis=1)
    usable = sent & (lengths > NO_LENGTH) & (lengths < LONGEST_BONE)
    usable[HIPS] = False
    if not usable.any():
        return 1.0, usable
    ratios = lengths / expected
    scale = float(np.median(ratios[usable]))
    usable &= (ratios < scale * OUT_OF_PROPORTION) & (ratios > scale / OUT_OF_PROPORTION)
    return scale, usable
