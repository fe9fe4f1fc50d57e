"""A body over time: a performer's joints or a character's nodes, and the limbs they belong to."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.bodies.body_plan import SIDES, BodyPlan, Chain, Limb
from devices.bodies.joint_names import Side
from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEAST_STEP = 1e-3  # [s] between two frames; stamps that repeat count as this far apart
_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class BodyTrack:
    """The joints of one body in T frames.

    Attributes:
        times: (T,) [s].
        positions: (T, K, 3) [m], +Y up; NaN where a joint was not seen.
        rotations: (T, K, 4) quaternions (x, y, z, w), world; NaN where unknown; None without any.
        plan: the parts of the body, of these joints.
    """

    times: Array
    positions: Array
    rotations: Array | None
    plan: BodyPlan

    def span(self, chain: Chain) -> Array:
        """Unit vectors (T, 3) from the first joint of a chain to its last; NaN where not seen."""
        return unit(self.positions[:, chain[-1]] - self.positions[:, chain[0]])

    def axes(self, pair: tuple[int, int]) -> Array:
        """The body's own left, up and front in each frame, (T, 3, 3) by rows.

        Args:
            pair: the left and the right joint that the left is told by.
        """
        left = self.positions[:, pair[0]] - self.positions[:, pair[1]]
        left = unit(left * [1.0, 0.0, 1.0])
        up = np.broadcast_to(_UP, left.shape)
        return np.stack([left, up, np.cross(left, up)], axis=1)

    @property
    def leg(self) -> float:
        """Median length of a leg from hip to ankle [m]; of the whole body's height without one."""
        limb = next((self.plan.legs[side] for side in SIDES if side in self.plan.legs), None)
        if limb is not None:
            joints = bends(limb)
            steps = np.diff(self.positions[:, joints], axis=1)
            length = _median(np.linalg.norm(steps, axis=2).sum(axis=1))
        else:
            length = _median(np.ptp(self.positions[..., 1], axis=1))
        return length if length > 0.0 else np.nan

    @property
    def hips(self) -> Array:
        """Between the two hip joints (T, 3) [m]; the hips where the body has no pair of legs."""
        pair = across(self.plan.legs)
        if pair is None:
            return self.positions[:, self.plan.hips]
        middle: Array = 0.5 * self.positions[:, pair].sum(axis=1)
        return middle

    def velocity(self, joint: int) -> Array:
        """Velocity (T - 1, 3) [m/s] of a joint from each frame to the next."""
        steps = np.maximum(np.diff(self.times), LEAST_STEP)
        rates: Array = np.diff(self.positions[:, joint], axis=0) / steps[:, None]
        return rates


def common_axes(performer: BodyTrack, character: BodyTrack) -> tuple[Array, Array] | None:
    """The axes of both bodies (T, 3, 3), by a pair of joints that both have: hips, or shoulders.

    None where they have no such pair, or the performer's is never seen.
    """
    for theirs, ours in (
        (performer.plan.legs, character.plan.legs),
        (performer.plan.arms, character.plan.arms),
    ):
        source, target = across(theirs), across(ours)
        if source and target and np.isfinite(performer.positions[:, source]).all((1, 2)).any():
            return performer.axes(source), character.axes(target)
    return None


def across(limbs: Mapping[Side, Limb]) -> tuple[int, int] | None:
    """The joints at which a pair of limbs begins, left and right; None where one is missing."""
    if any(side not in limbs for side in SIDES):
        return None
    return limbs[Side.LEFT].upper[0], limbs[Side.RIGHT].upper[0]


def bends(limb: Limb) -> Chain:
    """Shoulder, elbow and wrist, or hip, knee and ankle, as far as the limb has them."""
    ends = (limb.upper[0], limb.upper[-1])
    return (*ends, limb.lower[-1]) if limb.lower else ends


def off_body(skeleton: Skeleton) -> list[int]:
    """The joints that carry a body but are not part of it, such as a root on the floor."""
    plan = plan_by_names(skeleton)
    own = range(len(skeleton.names)) if plan is None else skeleton.tree.subtree(plan.hips)
    return sorted(set(range(len(skeleton.names))).difference(own))


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) with length 1; NaN where they have none."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 1e-12, lengths, np.nan)


def angle(a: Array, b: Array) -> Array:
    """The angles [degrees] between unit vectors (..., 3)."""
    degrees: Array = np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0)))
    return degrees


def _median(values: Array) -> float:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # nothing was seen: the answer is NaN
        return float(np.nanmedian(values))
