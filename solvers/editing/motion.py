"""The motion of a polyline as turning angles along it, q(s, t), and clips that play it.

Source: AniMesh (Jin et al. 2015), sections 5.1 and 6. This is the *ramp* kind: q(0, t) is where the
polyline starts, q passes through the rotation of each source bone at that bone's *end* and is
interpolated in between. So the turn of any piece of a polyline is the difference of q at its two
ends, and the turns of consecutive pieces multiply to the turn of the whole, whatever the pieces:
figure 6b, one bone by 90 degrees split into three by 30 each. The *pose-true* kind, for live
driving, is `solvers.retarget.polyline_motion`. `motion_of_bones` leads from rotations of bones to
this one; on the bones that it was taken from, the pose stays the same at every time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.skeleton.quaternions import multiply

Array = NDArray[np.float64]
Quaternion = tuple[float, float, float, float]

UNTURNED: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Rotations along a unit polyline over time: q(s, t). Motions are compared by identity.

    Attributes:
        times: (T,) [s] ascending, from 0.
        knots: (P,) arc-length parameters, ascending from 0 to 1, P >= 2.
        turns: (T, P, 4) q at each knot, since rest, in the axes of what the polyline hangs on; unit
            quaternions with signs that are continuous along time, so that a turn between two knots
            may pass 180 degrees.

    Raises:
        ValueError: a wrong shape, values that are not finite, or times or knots out of order.
    """

    times: Array
    knots: Array
    turns: Array

    def __post_init__(self) -> None:
        times = np.array(self.times, dtype=np.float64)
        knots = np.array(self.knots, dtype=np.float64)
        turns = np.array(self.turns, dtype=np.float64)
        if times.ndim != 1 or len(times) == 0 or times[0] != 0.0 or not (np.diff(times) > 0).all():
            raise ValueError("Expected `times` to have shape (T,), T > 0, and to ascend from 0")
        if knots.ndim != 1 or len(knots) < 2 or knots[0] != 0.0 or knots[-1] != 1.0:
            raise ValueError("Expected `knots` to have shape (P,), P > 1, from 0 to 1")
        if not (np.diff(knots) > 0.0).all():
            raise ValueError("Expected `knots` to ascend")
        if turns.shape != (len(times), len(knots), 4):
            expected = (len(times), len(knots), 4)
            raise ValueError(f"Expected `turns` to have shape {expected}, got {turns.shape}")
        norms = np.linalg.norm(turns, axis=2, keepdims=True)
        if not np.isfinite(times[-1]) or not np.isfinite(turns).all() or (norms < 1e-6).any():
            raise ValueError("Expected `times` and `turns` to be finite and `turns` not zero")
        turns = _continuous(turns / norms)
        for name, array in (("times", times), ("knots", knots), ("turns", turns)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def duration(self) -> float:
        """[s] from the first to the last frame."""
        return float(self.times[-1])

    def at(self, time: float) -> Array:
        """Return q at the knots (P, 4) at a `time` [s], held before the first and after the last.

        Between frames each knot takes the shorter way, at a constant rate.
        """
        first, second, share = self.between(time)
        return first if share == 0.0 else slerped(first, second, share)

    def between(self, time: float) -> tuple[Array, Array, float]:
        """Return the frames (P, 4) before and after a `time` [s], and the share between them."""
        after = int(np.searchsorted(self.times, time, side="right"))
        if after == 0 or after == len(self.times):
            held = self.turns[max(after - 1, 0)]
            return held, held, 0.0
        share = (time - self.times[after - 1]) / (self.times[after] - self.times[after - 1])
        return self.turns[after - 1], self.turns[after], float(share)


def motion_of_bones(times: ArrayLike, lengths: ArrayLike, turns: ArrayLike) -> Motion:
    """Return the motion of a polyline from the rotation of each of its bones.

    Args:
        times: (T,) [s] ascending, from 0.
        lengths: (B,) of the bones, outward; those without length are passed over.
        turns: (T, B, 4) rotation of each bone since rest against what the polyline hangs on.

    Raises:
        ValueError: as of `Motion`, or no bone has a length.
    """
    measured = np.asarray(lengths, dtype=np.float64)
    rotations = np.asarray(turns, dtype=np.float64)
    if rotations.ndim != 3 or rotations.shape[1:] != (len(measured), 4):
        raise ValueError(f"Expected `turns` of shape (T, {len(measured)}, 4): {rotations.shape}")
    if not (np.isfinite(measured).all() and (measured >= 0.0).all() and measured.sum() > 0.0):
        raise ValueError("Expected `lengths` to be finite, not negative, and one of them positive")
    ends = np.cumsum(measured) / measured.sum()
    ends[np.flatnonzero(measured)[-1] :] = 1.0
    kept = np.diff(np.concatenate([[0.0], ends])) > 1e-12
    still = np.tile(np.array(UNTURNED), (len(rotations), 1, 1))
    knots = np.concatenate([[0.0], ends[kept]])
    return Motion(np.asarray(times), knots, np.concatenate([still, rotations[:, kept]], axis=1))


@dataclass(frozen=True, slots=True)
class Clip:
    """A motion at a place in time, in the axes of the polylines that play it.

    Attributes:
        motion: what it plays.
        change: rotation from the motion's axes to those of the polyline (section 5.2).
        start: [s] when it begins; before that its first frame is held, after the end its last.
        speed: seconds of the motion for each second.
        passes: how often it is played, one after the other; may be infinite.
        weight: how much of it counts, in [0, 1].

    Raises:
        ValueError: a number that is not finite, or out of its range.
    """

    motion: Motion
    change: Quaternion = UNTURNED
    start: float = 0.0
    speed: float = 1.0
    passes: float = 1.0
    weight: float = 1.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.start):
            raise ValueError(f"Expected `start` to be finite, got {self.start}")
        if not (0.0 < self.speed < math.inf and self.passes > 0.0):
            raise ValueError(f"Expected a positive speed and passes: {self.speed}, {self.passes}")
        if not 0.0 <= self.weight <= 1.0:
            raise ValueError(f"Expected `weight` in [0, 1], got {self.weight}")

    def moment(self, time: float) -> float:
        """Return the motion's time [s] at a `time` [s]."""
        span = self.motion.duration
        if span == 0.0:
            return 0.0
        passed = min(max(time - self.start, 0.0) * self.speed, span * self.passes)
        whole = math.floor(passed / span)
        if math.isfinite(self.passes):
            whole = min(whole, math.ceil(self.passes) - 1)
        return min(max(passed - whole * span, 0.0), span)

    def at(self, time: float) -> Array:
        """Return q at the motion's knots (P, 4) at a `time` [s], in the polyline's axes."""
        turns = self.motion.at(self.moment(time))
        if self.change == UNTURNED:
            return turns
        change = np.array(self.change)
        return multiply(multiply(change, turns), change * np.array([-1.0, -1.0, -1.0, 1.0]))


def slerped(first: Array, second: Array, share: float | Array) -> Array:
    """Return quaternions (..., 4) a share (..., 1) of the shorter way from `first` to `second`."""
    cosine = (first * second).sum(axis=-1, keepdims=True)
    target = np.where(cosine < 0.0, -second, second)
    sine = np.linalg.norm(target - np.abs(cosine) * first, axis=-1, keepdims=True)
    angle = np.arctan2(sine, np.abs(cosine))
    safe = np.where(sine < 1e-7, 1.0, sine)
    one = np.where(sine < 1e-7, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    other = np.where(sine < 1e-7, share, np.sin(share * angle) / safe)
    mixed = one * first + other * target
    between: Array = mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
    return between


def _continuous(turns: Array) -> Array:
    """`turns` (T, P, 4) with signs: small turns between knots at first, then steady in time."""
    first = _signs((turns[0, 1:] * turns[0, :-1]).sum(axis=1))
    first[0] = 1.0 if turns[0, 0, 3] >= 0.0 else -1.0
    later = (turns[1:] * turns[:-1]).sum(axis=2)
    along = np.cumprod(np.where(later < 0.0, -1.0, 1.0), axis=0)
    signs = first * np.concatenate([np.ones((1, turns.shape[1])), along])
    signed: Array = turns * signs[:, :, None]
    return signed


def _signs(cosines: Array) -> Array:
    """The running sign (P,) that makes each of P rows agree with the one before it."""
    return np.concatenate([[1.0], np.cumprod(np.where(cosines < 0.0, -1.0, 1.0))])
