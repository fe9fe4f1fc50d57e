"""The view that shows the most of a skeleton, from the directions of its bones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.skeleton.tree import Tree

Array = NDArray[np.float64]

STEP = np.pi / 60.0  # [rad] between views that are tried
ALIKE = 0.99  # of the most that is shown: of such views the one nearest to the front is taken


def bones_of(tree: Tree) -> Array:
    """Return the bones of a tree (K - 1, 3), from each node's parent to the node."""
    nodes = np.array(tree.order[1:], dtype=np.int64)
    bones: Array = tree.positions[nodes] - tree.positions[tree.parents[nodes]]
    return bones


def shown_length(bones: Array, toward: Array) -> Array:
    """Return how much of the length of bones is seen from afar, as a share in [0, 1].

    Args:
        bones: (B, 3).
        toward: (..., 3) unit vectors from the skeleton to the viewer.
    """
    lengths = np.linalg.norm(bones, axis=1)
    total = float(lengths.sum())
    if total <= 0.0:
        return np.ones(np.shape(toward)[:-1])
    along = np.asarray(toward) @ bones.T
    seen: Array = np.sqrt(np.maximum(lengths**2 - along**2, 0.0)).sum(axis=-1) / total
    return np.minimum(seen, 1.0)


def widest_view(bones: Array, pitch: float, lowest: float, highest: float) -> tuple[float, float]:
    """Return azimuth and pitch [rad] of the viewer who sees the most bone length.

    The principal directions of the bones, weighted by their lengths, give the answer where any view
    is allowed: along the direction in which they reach least. A viewer who stands upright has only
    some, so these are tried, on a grid. Of all that show nearly the most, the one nearest to the
    front and to the usual pitch is taken.

    Args:
        bones: (B, 3), +Y up, the front at +Z.
        pitch: [rad] the usual one.
        lowest, highest: [rad] the pitches that are allowed.

    Source: AniMesh (Jin et al. 2015), section 3: the user orients the target on the screen.
    """
    azimuths = np.arange(-np.pi + STEP, np.pi + 0.5 * STEP, STEP)
    tried = np.append(np.arange(lowest, highest, STEP), (pitch, highest))
    pitches = np.unique(np.clip(tried, lowest, highest))
    around, up = np.meshgrid(azimuths, pitches, indexing="ij")
    toward = np.stack(
        [np.sin(around) * np.cos(up), np.sin(up), np.cos(around) * np.cos(up)], axis=-1
    )
    seen = shown_length(bones, toward.reshape(-1, 3)).reshape(around.shape)
    usual = np.array([0.0, np.sin(pitch), np.cos(pitch)])
    nearness = np.where(seen >= ALIKE * seen.max(), toward @ usual, -np.inf)
    best = np.unravel_index(int(np.argmax(nearness)), around.shape)
    return float(around[best]), float(up[best])
