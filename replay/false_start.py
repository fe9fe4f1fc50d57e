"""Replaces the first frames of a recording that do not belong to what follows.

A recorder that starts before its sensor is ready writes a frame without joints, with all joints in
one point, or in a T pose at the origin. A show that took it for the performer's first pose would
measure the way, the floor and the rotations of the whole clip from it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.recording import Recording

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MOST = 5  # frames that a false start has
JUMP, FASTEST, LONGEST = 0.1, 6.0, 0.1  # [m], [m/s], [s]: a joint is never as fast
TOGETHER = 0.15  # share of the joints that jump at once where a start is false
COLLAPSED = 0.3  # of the usual extent of the body
SEEN = 0.5  # of the usual number of joints
FEWEST = 10  # frames of a performer: a shorter recording is let be


def without_false_start(recording: Recording) -> Recording:
    """Return the recording with false first frames of each performer held at the first true one.

    Times stay. The recording itself is returned where nothing is wrong.
    """
    source = np.arange(len(recording))
    for performer in np.unique(recording.performers):
        own = np.flatnonzero(recording.performers == performer)
        if len(own) >= FEWEST:
            true = _first_true(recording.times[own], recording.positions[own[: 2 * FEWEST]])
            source[own[:true]] = own[true]
    if np.array_equal(source, np.arange(len(recording))):
        return recording
    blends = recording.blends
    return replace(
        recording,
        positions=recording.positions[source],
        rotations=None if recording.rotations is None else recording.rotations[source],
        confidence=recording.confidence[source],
        blends=None if blends is None else tuple(blends[index] for index in source),
    )


def _first_true(times: Array, positions: Array) -> int:
    """The number of the first frame that belongs to those after it, 0 for most recordings.

    Args:
        times: (T,) [s]
        positions: (n, J, 3) [m] of the first n of these frames; NaN where not seen.
    """
    seen: Bools = np.asarray(np.isfinite(positions).all(axis=2))
    count, extent = seen.sum(axis=1), _extents(positions, seen)
    usual, size = np.median(count[MOST:]), np.median(extent[MOST:])
    is_whole = (count > SEEN * usual) & (extent > COLLAPSED * size)
    steps = np.minimum(np.diff(times[: len(positions)]), LONGEST)
    ways = np.linalg.norm(np.diff(positions, axis=0), axis=2)
    both = seen[1:] & seen[:-1]
    far = (np.where(both, ways, 0.0) > JUMP + FASTEST * steps[:, None]).sum(axis=1)
    jumps = far > TOGETHER * np.maximum(both.sum(axis=1), 1)
    if jumps[MOST:].any() or not is_whole[MOST:].all():
        return 0  # it goes on as it begins: that is how this recording is
    false = ~is_whole[:MOST]
    false |= jumps[:MOST]
    return int(np.flatnonzero(false)[-1]) + 1 if false.any() else 0


def _extents(positions: Array, seen: Bools) -> Array:
    """The largest extent (n,) [m] of the joints that are seen in each frame."""
    low = np.where(seen[..., None], positions, np.inf).min(axis=1)
    high = np.where(seen[..., None], positions, -np.inf).max(axis=1)
    extents: Array = np.maximum(high - low, 0.0).max(axis=1)
    return extents
