"""Assign unnamed trackers to joints of the body, from a performer who stands upright."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from devices.bodies.humanoid import SIDES, humanoid_skeleton
from devices.skeleton import Skeleton
from solvers.skeleton.quaternions import conjugate, rotate

Array = NDArray[np.float64]

JOINTS = (
    "Hips",
    "Chest",
    "Head",
    *(side + bone for bone in ("LowerArm", "LowerLeg", "Foot") for side in SIDES),
)
"""The joints at which VRChat supports trackers: hip, chest, head, elbows, knees, feet."""

HEAD = JOINTS.index("Head")
_PARENTS = (-1, 0, 1, 1, 1, 0, 0, 5, 6)
_ARM_DOWN = 0.3  # [rad] from the vertical: a hanging upper arm
_LEAST_HEIGHT = 0.3  # [m] of the head, below which it gives no body height


def tracker_skeleton() -> Skeleton:
    """Return the tracker joints on a body with its arms down, facing +Z."""
    human = humanoid_skeleton()
    rest = human.rest_positions[[human.index(name) for name in JOINTS]].copy()
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        shoulder = human.rest_positions[human.index(f"{side}UpperArm")]
        elbow = JOINTS.index(f"{side}LowerArm")
        length = np.linalg.norm(rest[elbow] - shoulder)
        way = np.array([sign * math.sin(_ARM_DOWN), -math.cos(_ARM_DOWN), 0.0])
        rest[elbow] = shoulder + length * way
    return Skeleton(JOINTS, np.array(_PARENTS), rest)


def assign_trackers(
    trackers: Array, head: Array | None, facing: Array | None, *, taken: Iterable[int] = ()
) -> NDArray[np.int64]:
    """Return the index in JOINTS of each tracker's joint; all differ, and none is the head.

    A body of the performer's height is placed at the trackers. The assignment minimises the sum of
    squared distances.

    Args:
        trackers: (n, 3) [m], n at most 8.
        head: (3,) [m] position of the head, if known; it gives the body height.
        facing: (4,) rotation of the head (x, y, z, w), if known; it gives the body's heading.
        taken: joints that other trackers have.
    """
    places = tracker_skeleton().rest_positions
    scale = 1.0
    if head is not None and head[1] > _LEAST_HEIGHT:
        scale = float(head[1] / places[HEAD, 1])
    middle = trackers.mean(axis=0) if head is None else head
    at = (trackers - middle * (1.0, 0.0, 1.0)) / scale
    if facing is not None:
        yaw = np.array([0.0, facing[1], 0.0, facing[3]])  # the twist about +Y
        length = np.linalg.norm(yaw)
        if length > 1e-6:
            at = rotate(conjugate(yaw / length), at)
    free = np.array(sorted(set(range(len(JOINTS))) - {HEAD, *taken}))
    distances = ((at[:, None] - places[free]) ** 2).sum(axis=2)
    rows, columns = linear_sum_assignment(distances)
    chosen = np.empty(len(trackers), dtype=np.int64)
    chosen[rows] = free[columns]
    return chosen
