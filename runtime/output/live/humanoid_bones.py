"""Converts a performer's joint positions into local rotations of Unity's humanoid bones.

A performer has joint positions; a VMC model needs bone rotations. Each bone inherits the turn of
its parent, plus the smallest turn that aims it at its end. The hips, the chest and a hand with
knuckles also have a breadth direction, which gives their twist.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.humanoid import FINGERS, SEGMENTS, SIDES, humanoid_skeleton
from devices.bodies.joint_labels import label_joints
from devices.bodies.joint_names import BodyPart, Kind, Side
from devices.errors import InputError
from devices.skeleton import Skeleton
from solvers.skeleton.quaternions import conjugate, multiply, rotate

Array = NDArray[np.float64]
Vector = Sequence[float]

_TRUNK = ("Spine", "Chest", "UpperChest")
_SINGLE = {
    Kind.HIPS: "Hips",
    Kind.NECK: "Neck",
    Kind.HEAD: "Head",
    Kind.SHOULDER: "Shoulder",
    Kind.UPPER_ARM: "UpperArm",
    Kind.LOWER_ARM: "LowerArm",
    Kind.HAND: "Hand",
    Kind.UPPER_LEG: "UpperLeg",
    Kind.LOWER_LEG: "LowerLeg",
    Kind.FOOT: "Foot",
    Kind.TOES: "Toes",
}
_FINGER_KINDS = dict(
    zip((Kind.THUMB, Kind.INDEX, Kind.MIDDLE, Kind.RING, Kind.LITTLE), FINGERS, strict=True)
)
# The bone that each bone points to, or the next in the list where that is missing.
_POINTS_TO: dict[str, tuple[str, ...]] = {
    "Hips": ("Spine", "Chest", "UpperChest", "Neck", "Head"),
    "Spine": ("Chest", "UpperChest", "Neck", "Head"),
    "Chest": ("UpperChest", "Neck", "Head"),
    "UpperChest": ("Neck", "Head"),
    "Neck": ("Head",),
    **{
        f"{side}{bone}": tuple(f"{side}{end}" for end in ends)
        for side in SIDES
        for bone, ends in (
            ("Shoulder", ("UpperArm",)),
            ("UpperArm", ("LowerArm",)),
            ("LowerArm", ("Hand",)),
            ("Hand", ("MiddleProximal", "IndexProximal")),
            ("UpperLeg", ("LowerLeg",)),
            ("LowerLeg", ("Foot",)),
            ("Foot", ("Toes",)),
            *((f"{f}Proximal", (f"{f}Intermediate",)) for f in FINGERS),
            *((f"{f}Intermediate", (f"{f}Distal",)) for f in FINGERS),
        )
    },
}
# All rest poses stand upright, but joints of trunk and feet differ between skeletons, and arms may
# have any rest pose. So these bones use the performer's rest directions, the others a T-pose's.
_STANDING = ("Hips", *_TRUNK, "Neck", "LeftFoot", "RightFoot")
# The two bones that span the breadth of a bone, or the next pair where one is missing.
_SHOULDERS = (("RightShoulder", "LeftShoulder"), ("RightUpperArm", "LeftUpperArm"))
_BREADTHS: dict[str, tuple[tuple[str, str], ...]] = {
    "Hips": (("RightUpperLeg", "LeftUpperLeg"),),
    **{f"{side}Hand": ((f"{side}LittleProximal", f"{side}IndexProximal"),) for side in SIDES},
}


def humanoid_bones(skeleton: Skeleton) -> dict[str, int]:
    """Find the joint at the start of each humanoid bone, parents first.

    Raises:
        InputError: there are no hips or legs; VMC sends whole bodies.
    """
    parts = label_joints(skeleton)
    found: dict[str, int] = {}
    trunk: list[int] = []
    fingers: dict[str, list[int]] = {}
    for joint in skeleton.order:
        part = parts[joint]
        if part is None or part.tip:
            continue
        side = "" if part.side is Side.CENTRE else part.side.value.capitalize()
        if part.kind in (Kind.SPINE, Kind.CHEST):
            trunk.append(joint)
        elif part.kind in _SINGLE:
            found.setdefault(side + _SINGLE[part.kind], joint)
        elif part.kind in _FINGER_KINDS and not _in_palm(skeleton, parts, joint):
            fingers.setdefault(side + _FINGER_KINDS[part.kind], []).append(joint)
    found |= _trunk(skeleton, trunk, found.get("Head", found.get("Neck")))
    for finger, joints in fingers.items():
        found |= {finger + end: joint for end, joint in zip(SEGMENTS, joints, strict=False)}
    human = humanoid_skeleton()
    if not {"Hips", "LeftUpperLeg", "RightUpperLeg"} <= found.keys():
        raise InputError(
            "this performer cannot be sent by VMC, which needs a whole body: no hips with legs "
            "among the joints; leave --vmc out"
        )
    return {
        human.names[bone]: found[human.names[bone]]
        for bone in human.order
        if human.names[bone] in found
    }


def _in_palm(skeleton: Skeleton, parts: Sequence[BodyPart | None], joint: int) -> bool:
    """Whether a finger's joint is the near end of a metacarpal bone."""
    part = parts[joint]
    return part is not None and ("carpal" in part.word or "Metacarpal" in skeleton.names[joint])


def _trunk(skeleton: Skeleton, joints: Sequence[int], top: int | None) -> dict[str, int]:
    """Spine, chest and upper chest: the first, the middle and the last joint below the head."""
    below: list[int] = []
    joint = skeleton.root if top is None else int(skeleton.parents[top])
    while joint >= 0:
        if joint in joints:
            below.insert(0, joint)
        joint = int(skeleton.parents[joint])
    count = min(len(below), len(_TRUNK))
    if count == 0:
        return {}
    chosen = np.linspace(0, len(below) - 1, count).round().astype(int)
    return {bone: below[place] for bone, place in zip(_TRUNK, chosen.tolist(), strict=False)}


@dataclass(frozen=True, slots=True)
class _Bone:
    """The inputs for the turn of one bone; all are indices into the bones that exist.

    Attributes:
        parent: the parent bone, -1 for the world.
        end: the bone that it points to, or None for a bone that turns with its parent.
        at_rest: its unit direction in the model's T-pose.
        breadth: the two bones that span its breadth, or None.
        broad_at_rest: the unit direction of its breadth in a T-pose, empty without one.
    """

    parent: int
    end: int | None
    at_rest: Vector
    breadth: tuple[int, int] | None
    broad_at_rest: Vector


class HumanoidBones:
    """Computes the local poses of humanoid bones from a performer's joint positions.

    Args:
        skeleton: the performer's.

    Attributes:
        names: the K bones that the performer has, parents first.
        joints: (K,) the joint at the start of each.

    Raises:
        InputError: the performer has no hips and legs.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        found = humanoid_bones(skeleton)
        self.names = tuple(found)
        self.joints = np.array(list(found.values()))
        self._bones = [_bone(name, found, skeleton.rest_positions) for name in self.names]
        self._parents = np.array([bone.parent for bone in self._bones])

    def local(self, positions: Array) -> tuple[Array, Array]:
        """Offsets (K, 3) [m] and rotations (K, 4), bone to parent, of joints at (J, 3) [m]."""
        at = positions[self.joints]
        turns = np.array(self._turns(at.tolist()))
        upper, above = turns[self._parents], at[self._parents]
        upper[0], above[0] = (0.0, 0.0, 0.0, 1.0), 0.0  # the hips come first
        back = conjugate(upper)
        return rotate(back, at - above), multiply(back, turns)

    def _turns(self, at: Sequence[Vector]) -> list[Vector]:
        """The world rotation of each bone from the T-pose."""
        turns: list[Vector] = []
        for number, bone in enumerate(self._bones):
            upper = turns[bone.parent] if bone.parent >= 0 else (0.0, 0.0, 0.0, 1.0)
            turn = upper
            if bone.end is not None:
                turn = _after(
                    _swing(_turned(upper, bone.at_rest), _way(at[number], at[bone.end])), upper
                )
            if bone.breadth is not None:
                left, right = bone.breadth
                along = _turned(turn, bone.at_rest)
                was = _across(_turned(turn, bone.broad_at_rest), along)
                now = _across(_way(at[left], at[right]), along)
                turn = _after(_swing(was, now), turn)
            turns.append(turn)
        return turns


def _bone(name: str, found: Mapping[str, int], rest: Array) -> _Bone:
    """Collect the inputs for one bone among those in `found`; `rest` is the rest pose (J, 3)."""
    human = humanoid_skeleton()
    number = {bone: place for place, bone in enumerate(found)}

    def in_t_pose(bone: str) -> Array:
        position: Array = human.rest_positions[human.index(bone)]
        return position

    def unit(vector: Array) -> Vector:
        length = np.linalg.norm(vector)
        unit_vector: list[float] = (vector / length).tolist() if length > 0.0 else [0.0] * 3
        return unit_vector

    above = int(human.parents[human.index(name)])
    while above >= 0 and human.names[above] not in number:
        above = int(human.parents[above])
    end = next((end for end in _POINTS_TO.get(name, ()) if end in number), None)
    way = np.zeros(3)
    if end is not None and name in _STANDING:
        way = rest[found[end]] - rest[found[name]]
    elif end is not None:
        way = in_t_pose(end) - in_t_pose(name)
    pairs = _BREADTHS.get(name, _SHOULDERS if name == _top_of_trunk(found) else ())
    breadth = next((pair for pair in pairs if set(pair) <= number.keys() and end), None)
    return _Bone(
        parent=number[human.names[above]] if above >= 0 else -1,
        end=None if end is None else number[end],
        at_rest=unit(way),
        breadth=None if breadth is None else (number[breadth[0]], number[breadth[1]]),
        broad_at_rest=()
        if breadth is None
        else unit(in_t_pose(breadth[1]) - in_t_pose(breadth[0])),
    )


def _top_of_trunk(found: Mapping[str, int]) -> str | None:
    """The bone that carries the shoulders."""
    return next((bone for bone in reversed(_TRUNK) if bone in found), None)


# Vectors and quaternions are plain tuples: some fifty bones are computed one after another, and
# making an array of three numbers costs more than the arithmetic.


def _way(start: Vector, end: Vector) -> Vector:
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _across(vector: Vector, axis: Vector) -> Vector:
    """The component of a vector perpendicular to a unit axis."""
    along = _dot(vector, axis)
    return tuple(v - along * a for v, a in zip(vector, axis, strict=True))


def _after(p: Vector, q: Vector) -> Vector:
    """The rotation q followed by p."""
    (a, b, c, w), (x, y, z, v) = p, q
    return (
        w * x + a * v + b * z - c * y,
        w * y - a * z + b * v + c * x,
        w * z + a * y - b * x + c * v,
        w * v - a * x - b * y - c * z,
    )


def _turned(q: Vector, vector: Vector) -> Vector:
    twice = [2.0 * value for value in _cross(q, vector)]
    again = _cross(q, twice)
    return tuple(v + q[3] * t + s for v, t, s in zip(vector, twice, again, strict=True))


def _swing(start: Vector, end: Vector) -> Vector:
    """The smallest rotation from one direction to another; the identity if one has no length."""
    lengths = math.sqrt(_dot(start, start) * _dot(end, end))
    if lengths < 1e-9:
        return (0.0, 0.0, 0.0, 1.0)
    cosine = _dot(start, end) / lengths
    if cosine < -1.0 + 1e-9:  # any perpendicular axis will do
        least = min(range(3), key=lambda axis: abs(start[axis]))
        x, y, z = _cross(start, [float(axis == least) for axis in range(3)])
        w = 0.0
    else:
        x, y, z = (value / lengths for value in _cross(start, end))
        w = 1.0 + cosine
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / norm, y / norm, z / norm, w / norm)
