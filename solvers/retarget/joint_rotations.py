"""Relates the joint rotations in a stream to a body at rest, whatever the stream's convention.

At rest, "joint to world" is the identity in one file and a quarter turn in the next. One constant
turn between joint and rest is fitted from the bones of one frame. If no such turn explains them,
but the frame is the rest pose itself, each joint's turn is taken from there. Otherwise the
rotations mean something else and only directions can be used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from solvers.skeleton.quaternions import conjugate, multiply, rotate

Array = NDArray[np.float64]

MOST_RESIDUAL = np.radians(12.0)  # between where a bone is and where its joint says
_SAME = 2.0  # [deg] between the bones of a frame and those at rest, if it is the rest pose
_FEWEST = 3  # bones that a fit needs


@dataclass(frozen=True, slots=True, eq=False)
class RestTurn:
    """What turns each joint from rest to its rotation.

    Attributes:
        turns: (J, 4) from rest to the axes of each joint.
        is_usable: (J,) whether the joint's rotation explains the bones that begin at it.
    """

    turns: Array
    is_usable: NDArray[np.bool_]


def fit_rest_turn(
    parents: NDArray[np.int64], rest: Array, positions: Array, rotations: Array
) -> RestTurn | None:
    """Fit the constant turn between the joints' axes and the body at rest.

    Args:
        parents: (J,) parent of each joint, -1 at the root.
        rest: (J, 3) [m] at rest.
        positions: (J, 3) [m] in one frame.
        rotations: (J, 4) in that frame, joint to world; NaN where unknown.

    Returns:
        None where no turn explains the bones.
    """
    child = np.flatnonzero(parents >= 0)
    near = parents[child]
    bones, moved = rest[child] - rest[near], positions[child] - positions[near]
    long, now = np.linalg.norm(bones, axis=1), np.linalg.norm(moved, axis=1)
    real = np.isfinite(rotations[near]).all(axis=1) & np.isfinite(now)
    real &= (long > 1e-3 * long.max(initial=0.0)) & (now > 1e-3 * long.max(initial=0.0))
    if real.sum() < _FEWEST:
        return None
    child, near = child[real], near[real]
    bones = bones[real] / long[real, None]
    local = rotate(conjugate(rotations[near]), moved[real] / now[real, None])
    # The bones are weighed alike twice: a few that bend otherwise must not tilt the fit.
    weights = np.ones(len(near))
    for _ in range(3):
        turn, _ = Rotation.align_vectors(local, bones, weights)
        cosine = np.einsum("ij,ij->i", turn.apply(bones), local)
        residual = np.arccos(np.clip(cosine, -1.0, 1.0))
        weights = 1.0 / (1.0 + (residual / MOST_RESIDUAL) ** 2)
    if float(np.median(residual)) > MOST_RESIDUAL:
        return _fit_rest_itself(rotations, bones, moved[real] / now[real, None])
    worst = np.zeros(len(parents))
    np.maximum.at(worst, near, residual)
    usable: NDArray[np.bool_] = worst <= MOST_RESIDUAL
    return RestTurn(np.tile(turn.as_quat(), (len(parents), 1)), usable)


def _fit_rest_itself(rotations: Array, bones: Array, now: Array) -> RestTurn | None:
    """The turns of joints in a frame that is the rest pose, turned as a whole; else None.

    Args:
        rotations: (J, 4) of the frame.
        bones: (B, 3) unit directions at rest.
        now: (B, 3) unit directions in the frame.
    """
    whole, _ = Rotation.align_vectors(now, bones)
    cosine = np.einsum("ij,ij->i", whole.apply(bones), now)
    if float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max()) > _SAME:
        return None
    known = np.isfinite(rotations.sum(axis=1))
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (len(rotations), 1))
    turns[known] = multiply(conjugate(rotations[known]), whole.as_quat())
    return RestTurn(turns, known)
