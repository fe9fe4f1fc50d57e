"""Transfers the motion of one polyline to another, whatever the number of their bones.

Source: AniMesh (Jin et al. 2015), sections 5.1 and 5.2, figure 4.

Source bone i is rotated from rest by p_i, which is constant over the bone's part of the unit arc
length s. The function q(s) interpolates the p_i piecewise linearly, by slerp. Each target bone
takes a sample of q, so at each target node the limb turns by the difference of two samples. Three
choices are left open by the paper or made differently here:

- q passes through p_i at the middle of source bone i and is constant before the first and after the
  last middle. So a bend is spread evenly to both sides of its joint, and the turn of the first bone
  happens at the root. A straight limb, raised, stays straight.
- A target bone is sampled at its middle, the last one at s = 1. So a target with the same bones as
  the source takes its exact pose, and the turns along any target add up to the source's total.
- The basis follows the polyline's mean direction, which equals the first bone's on a straight limb.
  A first bone is often a stub across the body (pelvis to hip) or a short piece of an extracted
  curve. The mean direction is the one matched on the screen and does not depend on the sampling.

Rotations come from positions, so the twist of a bone about itself is unknown: each bone takes the
smallest rotation from the direction to which its predecessor has carried it.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import between, conjugate, multiply, normalized, power, rotate

Array = NDArray[np.float64]

# Within 15 degrees of the camera's up axis, noise would decide the sign of y.
_UPRIGHT: Final = math.sin(math.radians(15.0))
# Near the opposite of the rest direction the smallest rotation changes abruptly. Below the first
# cosine the last frame decides the rotation, above the second only the rest direction.
_OPPOSED, _FREE = -0.9, -0.5
# A joint may turn on beyond 180 degrees, up to this angle, before it takes the short way round.
_LONGEST_TURN: Final = math.cos(math.radians(270.0) / 2.0)


def mean_direction(points: Array) -> Array:
    """Return the unit vector (3,) from a polyline's start to its centre; +Z without length."""
    bones = np.diff(points, axis=0)
    lengths = np.linalg.norm(bones, axis=1)
    total = float(lengths.sum())
    if total < 1e-300:
        return np.array([0.0, 0.0, 1.0])
    mean = lengths @ (points[:-1] + 0.5 * bones - points[0]) / total
    for direction in (mean, *bones):
        norm = float(np.linalg.norm(direction))
        if norm > 1e-9 * total:
            break
    unit: Array = direction / norm
    return unit


def view_basis(direction: Array, view: Array) -> Array:
    """Return the right-handed basis of a polyline, a matrix of columns x, y, z.

    z is the unit `direction`; y is perpendicular to it and to the viewing direction and points up.
    Where the polyline points along the viewing direction, y is as near to up as it can be.

    Args:
        direction: (3,) unit vector of the polyline.
        view: (3, 3) rotation from the polyline's world to the camera (x right, y up, z to viewer).

    Source: AniMesh, section 5.1.
    """
    up, toward = view[1], view[2]
    y = np.cross(toward, direction)
    if np.linalg.norm(y) < 0.1:
        y = up - (up @ direction) * direction
    y /= np.linalg.norm(y)
    if y @ up < 0.0:
        y = -y
    return np.column_stack([np.cross(y, direction), y, direction])


def basis_change(
    source: Array, target: Array, source_view: Array, target_view: Array, *, flip: bool = False
) -> Array:
    """Return the rotation (3, 3) from the source polyline's world to the target polyline's.

    Args:
        source: (3,) unit direction of the source polyline.
        target: (3,) unit direction of the target polyline.
        source_view: (3, 3) rotation from the source's world to its capture device.
        target_view: (3, 3) rotation from the target's world to its camera.
        flip: reverse the target's y-axis, an option of the performer.

    Source: AniMesh, sections 5.1 and 5.2. Where a limb is upright on the screen, "up" does not
    determine the sign of its y-axis; then both limbs turn in the same sense on the screen.
    """
    source_basis = view_basis(source, source_view)
    target_basis = view_basis(target, target_view)
    rises = min(abs(source_basis[:, 1] @ source_view[1]), abs(target_basis[:, 1] @ target_view[1]))
    senses = (source_basis[:, 0] @ source_view[2]) * (target_basis[:, 0] @ target_view[2])
    opposite = bool(rises < _UPRIGHT and senses < 0.0)
    if opposite != flip:
        target_basis[:, :2] *= -1.0
    change: Array = target_basis @ source_basis.T
    return change


def bone_samples(source_rest: Array, target_rest: Array) -> tuple[NDArray[np.int64], Array]:
    """Return where each target bone samples q: between two source bones, at a share.

    Returns:
        (Q - 1, 2) the source bones on either side; (Q - 1,) the share of the way to the second.
        Source bones without length have no effect.
    """
    lengths = np.linalg.norm(np.diff(source_rest, axis=0), axis=1)
    real = np.flatnonzero(lengths > 1e-9 * lengths.sum())
    if len(real) == 0:
        real = np.arange(len(lengths))
    knots, samples = _middles(source_rest)[real], _middles(target_rest)
    samples[-1] = 1.0
    before = np.clip(np.searchsorted(knots, samples, side="right") - 1, 0, len(knots) - 1)
    after = np.minimum(before + 1, len(knots) - 1)
    gaps = knots[after] - knots[before]
    shares = np.divide(samples - knots[before], gaps, out=np.zeros(len(samples)), where=gaps > 0)
    return np.column_stack([real[before], real[after]]), np.clip(shares, 0.0, 1.0)


class ChainMap(NamedTuple):
    """The constants of the transfer from a source polyline to a target polyline.

    Attributes:
        rest: (P - 1, 3) unit directions of the source's bones; zero for a bone without length.
        axis: (3,) the rotation axis of a bone that points opposite to its rest direction.
        bones: (Q - 1, 2) as of `bone_samples`.
        shares: (Q - 1,) as of `bone_samples`.
        change: (3, 3) rotation from the source's world to the target's.
    """

    rest: Array
    axis: Array
    bones: NDArray[np.int64]
    shares: Array
    change: Array


def map_chain(
    source_rest: ArrayLike,
    target_rest: ArrayLike,
    source_view: ArrayLike,
    target_view: ArrayLike,
    flip: bool = False,
) -> ChainMap:
    """Prepare the transfer of motion from one polyline to another.

    Args:
        source_rest: (P, 3) source nodes at rest, from the root outward, P >= 2.
        target_rest: (Q, 3) target nodes at rest, from the root outward, Q >= 2.
        source_view: (3, 3) rotation from the source's world to its capture device.
        target_view: (3, 3) rotation from the target's world to its camera.
        flip: reverse the target's y-axis (section 5.2).

    Raises:
        ValueError: a wrong shape.
    """
    source, target = _polyline(source_rest, "source_rest"), _polyline(target_rest, "target_rest")
    views = _rotation(source_view, "source_view"), _rotation(target_view, "target_view")
    bones, shares = bone_samples(source, target)
    directions = mean_direction(source), mean_direction(target)
    change = basis_change(*directions, *views, flip=flip)
    return ChainMap(_directions(source), views[0][2].copy(), bones, shares, change)


def _polyline(points: ArrayLike, name: str) -> Array:
    array = np.array(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < 2:
        raise ValueError(f"Expected `{name}` to have shape (n, 3), n >= 2, got {array.shape}")
    return array


def _rotation(matrix: ArrayLike, name: str) -> Array:
    array = np.array(matrix, dtype=np.float64)
    if array.shape != (3, 3):
        raise ValueError(f"Expected `{name}` to have shape (3, 3), got {array.shape}")
    return array


def _directions(points: Array) -> Array:
    """Unit directions (n - 1, 3) of a polyline's bones; zero for a bone without length."""
    bones = np.diff(points, axis=0)
    lengths = np.linalg.norm(bones, axis=1, keepdims=True)
    directions: Array = np.divide(bones, lengths, out=np.zeros_like(bones), where=lengths > 1e-12)
    return directions


def _middles(points: Array) -> Array:
    """Unit arc-length parameters (n - 1,) of the middles of a polyline's bones."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if lengths.sum() < 1e-300:
        lengths = np.ones(len(lengths))
    ends = np.cumsum(lengths)
    middles: Array = (ends - 0.5 * lengths) / ends[-1]
    return middles


@kernel
def follow_bones(rest: Array, pose: Array, axis: Array, turns: Array, last: Array) -> None:
    """Update each bone's rotation against its predecessor, and its direction in that one's frame.

    Args:
        rest: (P - 1, 3) as of `ChainMap`.
        pose: (P, 3) positions of the source's nodes.
        axis: (3,) as of `ChainMap`.
        turns: (P - 1, 4) rotations of the last frame, zero before the first; overwritten.
        last: (P - 1, 3) each bone's direction, with its predecessor's rotation undone; overwritten.
    """
    carried = (0.0, 0.0, 0.0, 1.0)
    for i in range(len(rest)):
        x = pose[i + 1, 0] - pose[i, 0]
        y = pose[i + 1, 1] - pose[i, 1]
        z = pose[i + 1, 2] - pose[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        before = (turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3])
        known = before[0] ** 2 + before[1] ** 2 + before[2] ** 2 + before[3] ** 2 > 0.5
        d = (rest[i, 0], rest[i, 1], rest[i, 2])
        turn = before if known else (0.0, 0.0, 0.0, 1.0)
        if length > 1e-12 and d[0] ** 2 + d[1] ** 2 + d[2] ** 2 > 0.5:
            c = rotate(conjugate(carried), (x / length, y / length, z / length))
            turn = between(d, c, (axis[0], axis[1], axis[2]))
            if known:
                on = between((last[i, 0], last[i, 1], last[i, 2]), c, rotate(before, d))
                turn = _continue(turn, normalized(multiply(on, before)), d, c)
            last[i, 0], last[i, 1], last[i, 2] = c
        turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3] = turn
        carried = normalized(multiply(carried, turn))


@kernel
def _continue(
    smallest: tuple[float, float, float, float],
    moved_on: tuple[float, float, float, float],
    d: tuple[float, float, float],
    c: tuple[float, float, float],
) -> tuple[float, float, float, float]:
    """Blend the smallest rotation from rest with the last frame's, moved on without twist.

    Both take the rest direction d to c, so they differ by a twist about d. Where d and c oppose,
    the smallest rotation has a pole, and the last frame's is kept. Elsewhere the result does not
    depend on earlier frames, so nothing drifts.
    """
    cosine = d[0] * c[0] + d[1] * c[1] + d[2] * c[2]
    t = min(max((_FREE - cosine) / (_FREE - _OPPOSED), 0.0), 1.0)
    keep = t * t * (3.0 - 2.0 * t)
    gap = multiply(conjugate(smallest), moved_on)
    twist = 2.0 * math.atan2(gap[0] * d[0] + gap[1] * d[1] + gap[2] * d[2], gap[3])
    twist = keep * (twist - 2.0 * math.pi * math.floor(twist / (2.0 * math.pi) + 0.5))
    s = math.sin(0.5 * twist)
    turn = multiply(smallest, (s * d[0], s * d[1], s * d[2], math.cos(0.5 * twist)))
    return _same_side(turn, moved_on)


@kernel
def _same_side(
    turn: tuple[float, float, float, float], last: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """`turn` with the sign nearer to `last`, unless the rotation would then be too long."""
    near = turn[0] * last[0] + turn[1] * last[1] + turn[2] * last[2] + turn[3] * last[3]
    sign = -1.0 if near < 0.0 else 1.0
    if sign * turn[3] < _LONGEST_TURN:
        sign = -sign
    return (sign * turn[0], sign * turn[1], sign * turn[2], sign * turn[3])


@kernel
def sample_bones(
    turns: Array, bones: NDArray[np.int64], shares: Array, change: Array, sampled: Array
) -> None:
    """Write q at each target bone, in the target's world, to `sampled` (Q - 1, 4)."""
    carried = (0.0, 0.0, 0.0, 1.0)
    at = -1
    for j in range(len(bones)):
        before, after = bones[j]
        while at < before:
            at += 1
            turn = (turns[at, 0], turns[at, 1], turns[at, 2], turns[at, 3])
            carried = normalized(multiply(carried, turn))
        q = carried
        if after > before:  # bones in between have no length and no effect
            turn = (turns[after, 0], turns[after, 1], turns[after, 2], turns[after, 3])
            q = multiply(carried, power(turn, shares[j]))
        for k in range(3):
            sampled[j, k] = change[k, 0] * q[0] + change[k, 1] * q[1] + change[k, 2] * q[2]
        sampled[j, 3] = q[3]
