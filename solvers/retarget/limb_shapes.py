"""Compares the shapes of limbs on the screen, and picks the most different of many poses.

The score of AniMesh section 4.2 compares only the overall directions of branches; a bent arm and a
straight one score the same. For the choice of a rest state, from which the target's own rest shape
is turned, the shapes of the limbs should agree as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLES = (np.arange(8) + 0.5) / 8.0  # unit arc-length parameters

Array = NDArray[np.float64]


def shape_likeness(source: Array, target: Array, source_view: Array, target_view: Array) -> float:
    """Return the mean cosine between the directions of two polylines on the screen, in [-1, 1].

    Args:
        source: (P, 3) nodes from the root outward.
        target: (Q, 3) nodes from the root outward.
        source_view: (3, 3) rotation from the source's world to its capture device.
        target_view: (3, 3) rotation from the target's world to its camera.
    """
    ours = _directions(source @ source_view.T)
    theirs = _directions(target @ target_view.T)
    return float((ours * theirs).sum(axis=1).mean())


def most_different_poses(poses: Array, wanted: int) -> NDArray[np.int64]:
    """Return the ascending indices of poses that differ most, such as the extremes of a motion.

    Args:
        poses: (T, n, 3) points of each pose, T >= 1.
        wanted: the most poses.

    Source: Gonzalez 1985, farthest-first traversal.
    """
    flat = poses.reshape(len(poses), -1)
    gap = np.linalg.norm(flat - flat.mean(axis=0), axis=1)
    chosen = [int(np.argmax(gap))]
    gap = np.linalg.norm(flat - flat[chosen[0]], axis=1)
    while len(chosen) < wanted and gap.max() > 0.0:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(flat - flat[chosen[-1]], axis=1))
    return np.array(sorted(chosen), dtype=np.int64)


def _directions(points: Array) -> Array:
    """Direction on the screen (n, 2) at each of SAMPLES; short where a bone points into depth."""
    bones = np.diff(points, axis=0)
    lengths = np.linalg.norm(bones, axis=1)
    ends = np.cumsum(lengths)
    if ends[-1] <= 0.0:
        return np.zeros((len(SAMPLES), 2))
    bone = np.minimum(np.searchsorted(ends, SAMPLES * ends[-1]), len(bones) - 1)
    flat: Array = bones[bone, :2] / np.maximum(lengths[bone], 1e-300)[:, None]
    return flat
