"""How steady a character is while its performer is still, and how far a surface jumps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from runtime.benchmarks.resemblance.body_track import LEAST_STEP, BodyTrack
from runtime.benchmarks.resemblance.limbs import common_segments

Array = NDArray[np.float64]

STILL = 0.1  # leg lengths a second; a joint that is slower for `AROUND` is still
AROUND = 0.1  # [s] before and after
_FEWEST = 10  # moments at which a joint is still


def jitter(performer: BodyTrack, character: BodyTrack) -> tuple[float, float]:
    """Acceleration of the ends of limbs while the performer's are still.

    Returns:
        Medians [leg lengths / s^2] of the character and of the performer; NaN where the performer
        is never still.
    """
    theirs, ours = [], []
    for source, target in _ends(performer, character):
        is_still = _is_still(performer, source)
        theirs.append(_acceleration(performer, source)[is_still])
        ours.append(_acceleration(character, target)[is_still])
    if sum(map(len, ours)) < _FEWEST:
        return np.nan, np.nan
    return float(np.median(np.concatenate(ours))), float(np.median(np.concatenate(theirs)))


def steps_of_joints(positions: Array) -> Array:
    """The farthest that any joint (T, J, 3) moves to each next frame, (T - 1,) [heights].

    A joint that was not seen in both frames does not move.
    """
    steps = np.nan_to_num(np.linalg.norm(np.diff(positions, axis=0), axis=2)).max(axis=1)
    seen = positions[np.isfinite(positions[..., 1]).any(axis=1), :, 1]
    if not len(seen):
        return np.zeros(len(steps))
    height = float(np.median(np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1)))
    scaled: Array = steps / max(height, 1e-9)
    return scaled


def _ends(performer: BodyTrack, character: BodyTrack) -> Iterator[tuple[int, int]]:
    for _, joints, nodes in common_segments(performer, character):
        yield joints[-1], nodes[-1]


def _acceleration(body: BodyTrack, joint: int) -> Array:
    """Acceleration (T - 2,) [leg lengths / s^2]; NaN where a joint was not seen."""
    steps = np.maximum(np.diff(body.times), LEAST_STEP)
    rates = np.diff(body.velocity(joint), axis=0)
    lengths: Array = np.linalg.norm(rates, axis=1) / (0.5 * (steps[:-1] + steps[1:])) / body.leg
    return lengths


def _is_still(body: BodyTrack, joint: int) -> NDArray[np.bool_]:
    """Whether a joint stays near its place around each of the frames between the ends, (T - 2,)."""
    times, places = body.times, body.positions[:, joint]
    before = np.searchsorted(times, times - AROUND)
    after = np.searchsorted(times, times + AROUND, side="right") - 1
    gap = np.linalg.norm(places[after] - places[before], axis=1)
    spent = times[after] - times[before]
    most = np.where(spent >= AROUND, STILL * body.leg * spent, -1.0)
    # Both accelerations are known where all three frames were seen.
    is_seen: NDArray[np.bool_] = np.isfinite(places[:, 0])
    still: NDArray[np.bool_] = gap[1:-1] < most[1:-1]
    return still & is_seen[:-2] & is_seen[1:-1] & is_seen[2:]
