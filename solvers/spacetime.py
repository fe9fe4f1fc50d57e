"""Transfers whole trajectories of joints to a character's control points, from example poses.

Pairs of example poses give the position of each control point for a position of its joint. In every
frame a joint is an affine combination of its examples, and its control point is the same
combination of its own examples. All frames are solved at once, so the path is smooth and meets
constraints exactly.

Source: Celikcan, Yaz and Capin 2015, section 5, equations 14 to 25.

The paper uses four examples a frame, for which equation 14 has one solution. If these four lie
nearly in a plane, that solution varies wildly, and the path jumps where other examples become the
nearest. Here all examples are used, and of the many solutions the one with the least norm, weighted
by nearness: moving least squares (Levin 1998). It meets the examples, is smooth between them, and
reproduces affine maps. A ridge damps the direction across examples that lie in a plane. The paper's
system is then solved around these weights. Its unknowns, a weight for each example in each frame,
affect only the control points, so the control points are the unknowns here. The cost of the weights
becomes a covariance (3, 3) of each point in each frame: how freely the point may move.

Joints and control points are measured from the mean of their own examples, in units of the
examples' spread. So neither units nor the choice of an origin matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded
from scipy.sparse.linalg import splu

ACCELERATION: Final = 0.3  # the paper's weight of smoothness, lambda_A
_RIDGE = 1e-2  # of the examples' extent: flatter examples give no motion across their plane
_PULL = 1e-2  # cost of a weight that differs from moving least squares, times the nearness
_FARTHEST = 1e-4  # the least nearness of an example
_SLACK = 1e-10  # of a constraint in the factor; iterative refinement removes it
_REFINEMENTS = 3
_MET = 1e-6  # of the examples' spread; a larger error means that a constraint cannot be met

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Constraint:
    """A linear condition that control points meet exactly: sum of factor * position = value.

    Attributes:
        terms: frame, joint and factor of each position in the sum.
        value: one number for each axis, in the control points' unit.
        axes: the axes x, y, z (0, 1, 2) for which it holds.
    """

    terms: tuple[tuple[int, int, float], ...]
    value: tuple[float, ...]
    axes: tuple[int, ...]


def position_constraint(
    frame: int, joint: int, position: Sequence[float], axes: Sequence[int] = (0, 1, 2)
) -> Constraint:
    """Return the constraint that a control point is at `position`, by axis (equation 22).

    Args:
        frame: of the T frames.
        joint: of the J control points.
        position: one number for each of `axes`, in the control points' unit.
        axes: which of x, y, z (0, 1, 2).
    """
    return Constraint(((frame, joint, 1.0),), tuple(map(float, position)), tuple(axes))


def velocity_constraint(
    frame: int, joint: int, velocity: Sequence[float], axes: Sequence[int] = (0, 1, 2)
) -> Constraint:
    """Return the constraint that a control point moves by `velocity` in a frame (equation 23).

    The motion is that from the frame before `frame`. Other arguments as of `position_constraint`.
    """
    terms = (frame, joint, 1.0), (frame - 1, joint, -1.0)
    return Constraint(terms, tuple(map(float, velocity)), tuple(axes))


def equality_constraint(
    frame: int, joint: int, other: int, axes: Sequence[int] = (1,)
) -> Constraint:
    """Return the constraint that two control points are equal on `axes`.

    An example is the height of two feet while one takes over the ground contact from the other.
    """
    terms = (frame, joint, 1.0), (frame, other, -1.0)
    return Constraint(terms, (0.0,) * len(axes), tuple(axes))


def retarget_trajectories(
    joint_examples: ArrayLike,
    control_examples: ArrayLike,
    joint_path: ArrayLike,
    *,
    acceleration: float = ACCELERATION,
    constraints: Sequence[Constraint] = (),
) -> Array:
    """Return paths of control points that follow joints as in the examples.

    Where a joint rests at one of its examples, its control point rests at the paired example. A
    rotation, translation or scaling of all joints, examples and path, does not change the result.

    Args:
        joint_examples: (E, J, 3) positions of the joints in each example, in the performer's frame.
        control_examples: (E, J, 3) positions of their control points, in the character's frame.
        joint_path: (T, J, 3) positions of the joints in each frame, as in `joint_examples`.
        acceleration: the weight of smoothness, lambda_A; 0 treats each frame by itself.
        constraints: conditions that the paths meet exactly.

    Returns:
        (T, J, 3) positions of the control points in each frame, as in `control_examples`.

    Raises:
        ValueError: for wrong shapes, numbers that are not finite, an acceleration below zero, or a
            constraint that names a missing frame or joint or that these examples cannot meet.
    """
    joints, controls, path = _checked(joint_examples, control_examples, joint_path)
    if not (np.isfinite(acceleration) and acceleration >= 0.0):
        raise ValueError(f"expected an acceleration of at least 0, got {acceleration}")
    _check_constraints(constraints, path.shape[:2])
    guides = [
        _guide(joints[:, joint], controls[:, joint], path[:, joint], acceleration)
        for joint in range(path.shape[1])
    ]
    bound = sorted({joint for one in constraints for _, joint, _ in one.terms})
    met = _meet({joint: guides[joint] for joint in bound}, constraints) if bound else {}
    paths = np.empty_like(path)
    for joint, guide in enumerate(guides):
        paths[:, joint] = met[joint] if joint in met else _smooth(guide)
    return paths


@dataclass(frozen=True, slots=True, eq=False)
class _Guide:
    """The preferred path of one control point, and how freely the point may leave it.

    Attributes:
        path: (T, 3) of each frame by itself.
        freedom: (T, 3, 3) covariance of each frame.
        stiffness: the factor of an acceleration.
        spread: root mean square distance of the control point's examples from their mean.
    """

    path: Array
    freedom: Array
    stiffness: float
    spread: float


def _guide(joints: Array, controls: Array, path: Array, acceleration: float) -> _Guide:
    """The guide of one joint: examples (E, 3), (E, 3) and path (T, 3)."""
    start, unit = _measure(joints)
    joints, path = (joints - start) / unit, (path - start) / unit
    middle, spread = _measure(controls)
    controls = controls - middle
    weights, nearness = _combine(joints, path)
    freedom = _freedom(joints, controls, nearness)
    return _Guide(middle + weights @ controls, freedom, acceleration / spread, spread)


def _measure(points: Array) -> tuple[Array, float]:
    """The mean of points (E, 3), and their root mean square distance from it; 1 for one place."""
    middle = points.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((points - middle) ** 2, axis=1))))
    return middle, spread if spread > 1e-12 * float(np.abs(points).max()) else 1.0


def _combine(examples: Array, path: Array) -> tuple[Array, Array]:
    """Each point of a path (T, 3) as a combination of examples (E, 3).

    Returns:
        (T, E) the weights, which sum to 1: those that solve equation 14 with the least sum of
        squares over nearness; and (T, E) the nearness, of inverse squared distances, which sums
        to 1 as well.
    """
    offsets = examples - path[:, None]
    near = 1.0 / np.maximum(np.einsum("tei,tei->te", offsets, offsets), 1e-20)
    leaning = near[:, :, None] * offsets
    spans = np.matmul(np.swapaxes(leaning, 1, 2), offsets)
    spans += _RIDGE * len(examples) / 3.0 * np.eye(3)
    lean = leaning.sum(axis=1)
    slope = np.linalg.solve(spans, lean[:, :, None])
    weights = near * (1.0 - np.matmul(offsets, slope)[:, :, 0])
    total = near.sum(axis=1, keepdims=True)
    return weights / weights.sum(axis=1, keepdims=True), near / total


def _freedom(joints: Array, controls: Array, nearness: Array) -> Array:
    """How freely a control point may move in each frame, (T, 3, 3): C P^-1 C'.

    P = J'J + pull / nearness is the cost of weights that differ from those of `_combine`; its
    inverse needs only 4 x 4 systems (Woodbury).
    """
    J = np.concatenate([joints.T, np.ones((1, len(joints)))])  # equation 14
    loose = np.maximum(nearness, _FARTHEST)[:, None, :] / _PULL
    both = np.concatenate([controls.T, J])  # (7, E)
    crossed = np.matmul(both * loose, both.T)
    crossed[:, 3:, 3:] += np.eye(4)
    bent = np.linalg.solve(crossed[:, 3:, 3:], crossed[:, 3:, :3])
    freedom: Array = crossed[:, :3, :3] - np.matmul(crossed[:, :3, 3:], bent)
    return freedom


def _smooth(guide: _Guide) -> Array:
    """The path (T, 3) without constraints: the guide's, with less acceleration."""
    frames = len(guide.path)
    if frames < 3 or guide.stiffness == 0.0:
        return guide.path
    steps = np.diff(guide.path, 2, axis=0)
    S = guide.stiffness**2 * guide.freedom
    blocks = [S[:-2] + 4.0 * S[1:-1] + S[2:], -2.0 * (S[1:-2] + S[2:-1]), S[2:-2]]
    blocks[0] += np.eye(3)
    pushes = solveh_banded(_banded(blocks), steps.ravel(), lower=True, check_finite=False)
    padded = np.zeros((frames + 2, 3))  # so that its differences are the transposed ones
    padded[2:-2] = guide.stiffness**2 * pushes.reshape(-1, 3)
    moved: Array = np.matmul(guide.freedom, np.diff(padded, 2, axis=0)[:, :, None])[:, :, 0]
    return guide.path - moved


def _banded(blocks: list[Array]) -> Array:
    """Lower bands (9, 3 n) of a symmetric matrix whose lower blocks are given, by diagonals."""
    count = len(blocks[0])
    bands = np.zeros((9, count, 3))
    for apart, diagonal in enumerate(blocks):
        for row in range(3):
            for column in range(3):
                below = 3 * apart + row - column
                if below >= 0:
                    bands[below, : len(diagonal), column] = diagonal[:, row, column]
    return bands.reshape(9, -1)


def _meet(guides: Mapping[int, _Guide], constraints: Sequence[Constraint]) -> dict[int, Array]:
    """Paths (T, 3) of the joints that constraints name, by Lagrange multipliers (equation 25)."""
    frames = len(next(iter(guides.values())).path)
    places = {joint: number for number, joint in enumerate(guides)}
    wanted = np.concatenate([guide.path.ravel() for guide in guides.values()])
    freedom = sp.block_diag(
        [_along_diagonal(guide.freedom) for guide in guides.values()], format="csr"
    )
    each = sp.eye(frames, format="csr")
    steps = each[2:] - 2.0 * each[1:-1] + each[:-2]
    smooth = sp.block_diag(
        [guide.stiffness * sp.kron(steps, sp.eye(3)) for guide in guides.values()], format="csr"
    )
    most = max(guide.spread for guide in guides.values())
    rows, values = _rows(places, frames, constraints)
    both = sp.vstack([smooth, rows / most], format="csr")
    missing = np.concatenate([-(smooth @ wanted), (values - rows @ wanted) / most])
    soft = np.r_[np.ones(smooth.shape[0]), np.zeros(len(values))]
    exact = sp.csc_matrix(both @ freedom @ both.T + sp.diags(soft))
    factor = splu(
        exact + sp.diags(_SLACK * (1.0 - soft), format="csc"),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    pushes = factor.solve(missing)
    for _ in range(_REFINEMENTS):
        pushes += factor.solve(missing - exact @ pushes)
    found = wanted + freedom @ (both.T @ pushes)
    _check_met(np.abs(rows @ found - values) / most, constraints)
    paths = found.reshape(len(guides), frames, 3)
    return {joint: paths[number] for joint, number in places.items()}


def _along_diagonal(blocks: Array) -> sp.bsr_matrix:
    """A matrix with blocks (T, 3, 3) along its diagonal."""
    return sp.bsr_matrix((blocks, np.arange(len(blocks)), np.arange(len(blocks) + 1)))


def _rows(
    places: Mapping[int, int], frames: int, constraints: Sequence[Constraint]
) -> tuple[sp.csr_matrix, Array]:
    """The constraints on all paths: a row and a value for each of their axes."""
    data: list[tuple[float, int, int]] = []
    values: list[float] = []
    for constraint in constraints:
        for axis, value in zip(constraint.axes, constraint.value, strict=True):
            for frame, joint, factor in constraint.terms:
                column = 3 * (places[joint] * frames + frame) + axis
                data.append((factor, len(values), column))
            values.append(value)
    factors, rows, columns = zip(*data, strict=True)
    shape = len(values), 3 * frames * len(places)
    return sp.csr_matrix((factors, (rows, columns)), shape=shape), np.array(values)


def _check_met(missed: Array, constraints: Sequence[Constraint]) -> None:
    if missed.max(initial=0.0) > _MET:
        owner = np.repeat(np.arange(len(constraints)), [len(one.axes) for one in constraints])
        number = int(owner[np.argmax(missed)])
        frame, joint, _ = constraints[number].terms[0]
        raise ValueError(
            f"constraint {number} cannot be met: the examples of control point {joint} do not "
            f"reach there in frame {frame}, or another constraint says otherwise"
        )


def _checked(
    joint_examples: ArrayLike, control_examples: ArrayLike, joint_path: ArrayLike
) -> tuple[Array, Array, Array]:
    named = {
        "joint_examples": np.asarray(joint_examples, dtype=np.float64),
        "control_examples": np.asarray(control_examples, dtype=np.float64),
        "joint_path": np.asarray(joint_path, dtype=np.float64),
    }
    for name, points in named.items():
        if points.ndim != 3 or points.shape[2] != 3 or len(points) == 0:
            raise ValueError(f"expected {name} (at least 1, J, 3), got {points.shape}")
        if not np.isfinite(points).all():
            raise ValueError(f"expected finite {name}, got {points[~np.isfinite(points)][0]}")
    joints, controls, path = named.values()
    if joints.shape != controls.shape:
        raise ValueError(
            f"expected as many control_examples as joint_examples {joints.shape}, got "
            f"{controls.shape}"
        )
    if path.shape[1] != joints.shape[1]:
        raise ValueError(f"expected {joints.shape[1]} joints in joint_path, got {path.shape[1]}")
    return joints, controls, path


def _check_constraints(constraints: Sequence[Constraint], shape: tuple[int, ...]) -> None:
    frames, joints = shape
    for number, constraint in enumerate(constraints):
        if not (constraint.terms and constraint.axes):
            raise ValueError(f"expected at least one position and axis in constraint {number}")
        for frame, joint, factor in constraint.terms:
            if not (0 <= frame < frames and 0 <= joint < joints):
                raise ValueError(
                    f"constraint {number} names frame {frame} of joint {joint}, but there are "
                    f"{frames} frames of {joints} joints"
                )
            if not np.isfinite(factor):
                raise ValueError(f"expected a finite factor in constraint {number}, got {factor}")
        if not set(constraint.axes) <= {0, 1, 2} or len(constraint.value) != len(constraint.axes):
            raise ValueError(
                f"expected a value for each of the axes 0, 1 or 2 in constraint {number}, got "
                f"{constraint.value} for {constraint.axes}"
            )
        if not np.isfinite(constraint.value).all():
            raise ValueError(f"expected finite values in constraint {number}")
