"""How alike polylines look on the screen, bone by bone; and which poses of many differ most.

The score of AniMesh section 4.2 compares where branches lead as a whole; a bent arm and a straight
one score the same. Where one of many poses is to become the rest state, from which the target's
own rest shape is turned, the shapes of the limbs should agree as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLES = (np.arange(8) + 0.5) / 8.0  # of the unit arc length

Array = NDArray[np.float64]


def shape_likeness(source: Array, target: Array, source_view: Array, target_view: Array) -> float:
    """Mean cosine between the directions of two polylines on the screen, in [-1, 1].

    Args:
        source: (P, 3) nodes from the root outward.
        target: (Q, 3) likewise.
        source_view: (3, 3) rotation from the source's world to its capture device.
        target_view: (3, 3) rotation from the target's world to its camera.
    """
    ours = _directions(source @ source_view.T)
    theirs = _directions(target @ target_view.T)
    return float((ours * theirs).sum(axis=1).mean())


def most_different_poses(poses: Array, wanted: int) -> NDArray[np.int64]:
    """Indices, rising, of poses far from each other: the extremes of a motion come first.

    Args:
        poses: (T, n, 3) points of each pose, T >= 1.
        wanted: how many, at most.

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
    """Direction on the screen (n, 2) at each of SAMPLES; short where it leads into the depth."""
    bones = np.diff(points, axis=0)
    lengths = np.linalg.norm(bones, axis=1)
    ends = np.cumsum(lengths)
    if ends[-1] <= 0.0:
        return np.zeros((len(SAMPLES), 2))
    bone = np.minimum(np.searchsorted(ends, SAMPLES * ends[-1]), len(bones) - 1)
    flat: Array = bones[bone, :2] / np.maximum(lengths[bone], 1e-300)[:, None]
    return flat
