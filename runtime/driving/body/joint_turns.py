"""How the performer's joints are turned, if the stream gives rotations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton
from runtime.driving.performer import Pose
from solvers.retarget.joint_rotations import RestTurn, fit_rest_turn
from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]

_OTHERS = 8  # poses that are looked at where the first one shows nothing


class JointTurns:
    """The turns of some joints from the performer standing upright.

    Args:
        performer: the performer's skeleton.
        joints: W joints; -1 for one that is never known.
        upright: [rad] heading of the performer's rest pose.
        facing: [rad] heading of the character, in whose direction the turns are given.
    """

    def __init__(
        self, performer: Skeleton, joints: Sequence[int], upright: float, facing: float
    ) -> None:
        self._performer = performer
        self._joints = np.array(joints, dtype=np.int64)
        self._facing = facing
        self._from_rest = about_vertical(upright - facing)
        self._fitted: RestTurn | None = None

    def turns(self, pose: Pose, heading: float) -> Array:
        """Return the world rotations (W, 4) of the joints from rest; zero where unknown.

        Args:
            pose: of the performer.
            heading: [rad] the turn of the whole performer, which is taken out.
        """
        turns = np.zeros((len(self._joints), 4))
        if pose.rotations is None or not len(self._joints):
            return turns
        if self._fitted is None:
            self._fitted = self._fit(pose, pose.rotations)
        own = pose.rotations[self._joints]
        known = (self._joints >= 0) & self._fitted.is_usable[self._joints]
        known &= np.isfinite(own).all(axis=1)
        whole = about_vertical(self._facing - heading)
        turned = multiply(
            whole, multiply(own, multiply(self._fitted.turns[self._joints], self._from_rest))
        )
        turns[known] = turned[known]
        return turns

    def learn(self, clip: Sequence[Pose]) -> bool:
        """Find out from poses what the rotations mean; return whether they can be used.

        The first pose comes first, as it may be the rest pose itself. Where it does not explain
        half of the joints that it shows, the best of others does.
        """
        step = max(len(clip) // _OTHERS, 1)
        best = 0
        for pose in [*clip[:1], *clip[step::step]]:
            if pose.rotations is None:
                continue
            fitted = self._fit(pose, pose.rotations)
            usable = int(fitted.is_usable.sum())
            if usable > best or self._fitted is None:
                self._fitted, best = fitted, usable
            if 2 * best >= len(self._performer.names):
                break
        return best > 0

    def _fit(self, pose: Pose, rotations: Array) -> RestTurn:
        rest, parents = self._performer.rest_positions, self._performer.parents
        nothing = np.zeros(len(rest), dtype=np.bool_)
        unknown = RestTurn(np.tile([0.0, 0.0, 0.0, 1.0], (len(rest), 1)), nothing)
        return fit_rest_turn(parents, rest, pose.seen, rotations) or unknown

    def snapshot(self) -> RestTurn | None:
        """Return what was fitted."""
        return self._fitted

    def restore(self, state: RestTurn | None) -> None:
        """Go back to a snapshot."""
        self._fitted = state


def about_vertical(angle: float) -> Array:
    """Return the rotation (4,) by `angle` [rad] about +Y."""
    return np.array([0.0, np.sin(0.5 * angle), 0.0, np.cos(0.5 * angle)])
