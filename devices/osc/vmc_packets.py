"""VMC bone messages in a packet: bone names, possible poses, and runs of bones read at once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.humanoid_kernels import FARTHEST
from devices.bodies.humanoid_pose import SKELETON
from devices.bodies.unity_space import across_unity, turn_across_unity
from devices.osc.layouts import Span
from devices.osc.messages import Message

BONES = {name: joint for joint, name in enumerate(SKELETON.names)}
BONE_ADDRESS = "/VMC/Ext/Bone/Pos"
POSE_TAGS = "sfffffff"
FEWEST_IN_A_RUN = 4  # bones that are worth reading together
_BONES_ANY_CASE = {name.lower(): joint for name, joint in BONES.items()}
_POSE_BYTES = 28

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Consecutive bone messages of a packet, no bone twice.

    Attributes:
        joints: (n,) of the bones.
        places: (n,) offset in the packet of the seven numbers of each.
        parts: the joints as a set.
        spans: begin and end of each message.
    """

    joints: Indices
    places: Indices
    parts: frozenset[int]
    spans: tuple[Span, ...]


Plan = tuple[Run | Span, ...]
"""Contents of a packet, in order: runs of bones, and the begin and end of each other message."""


def bone_called(name: str) -> int | None:
    """Return the joint of the bone called `name`, in any case, or None."""
    joint = BONES.get(name)
    return _BONES_ANY_CASE.get(name.lower()) if joint is None else joint


def plan_packet(messages: Sequence[tuple[Span, Message]]) -> Iterator[Run | Span]:
    """Yield runs of bones, each as long as possible, and every other message on its own."""
    run: dict[int, Span] = {}
    for span, message in messages:
        joint = None
        if message.address == BONE_ADDRESS and message.tags == POSE_TAGS:
            joint = bone_called(str(message.arguments[0]))
        if joint is None or joint in run:
            yield from _run_or_spans(run)
            run = {}
        if joint is None:
            yield span
        else:
            run[joint] = span
    yield from _run_or_spans(run)


def _run_or_spans(bones: Mapping[int, Span]) -> Iterator[Run | Span]:
    if len(bones) < FEWEST_IN_A_RUN:
        yield from bones.values()
        return
    joints = np.array(list(bones), dtype=np.int64)
    places = np.array([end - _POSE_BYTES for _, end in bones.values()], dtype=np.int64)
    yield Run(joints, places, frozenset(bones), tuple(bones.values()))


def checked_pose(numbers: Sequence[float]) -> tuple[Array, Array] | None:
    """Return position and unit quaternion in our space; None if they are implausible."""
    px, py, pz, x, y, z, w = numbers
    if not abs(px) + abs(py) + abs(pz) < FARTHEST:  # also for NaN
        return None
    square = x * x + y * y + z * z + w * w
    if not 0.25 < square < 4.0:
        return None
    turn = turn_across_unity((x, y, z, w)) / math.sqrt(square)
    return across_unity((px, py, pz)), turn
