"""The lowest points of a character's feet, moved with its skin.

A foot hardly turns against its shin while it stands, so its points follow the linear blend of the
motions of their nodes, which costs a tenth of what the character's own surface costs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import quaternion, rotate
from solvers.kernels.vector import minus, point
from solvers.skeleton.tree import Tree
from solvers.surface.skin_weights import Skin

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_TILTS = 100  # of a foot, in which its lowest points are looked for
_GOLDEN = np.pi * (3.0 - 5.0**0.5)  # [rad] from one tilt to the next, spread evenly


class Soles:
    """The soles of F feet.

    Args:
        tree: the character's nodes at rest.
        ankles: F nodes at which the feet begin.
        vertices: (C, 3) [m] of the surface at rest.
        skin: what the vertices follow.

    Attributes:
        at_rest: (F,) [m] height of each sole at rest above the lowest vertex.
    """

    def __init__(self, tree: Tree, ankles: Sequence[int], vertices: Array, skin: Skin) -> None:
        owner = skin.nodes[:, 0]
        feet = [np.flatnonzero(np.isin(owner, tree.subtree(ankle))) for ankle in ankles]
        lowest = [foot[_undermost(vertices[foot])] for foot in feet]
        chosen = np.concatenate([np.zeros(0, dtype=np.int64), *lowest])
        self._ends = np.cumsum([0, *(len(foot) for foot in lowest)])
        self._ankles = np.array(ankles, dtype=np.int64)
        self._points, self._rest = vertices[chosen], tree.positions
        self._nodes, self._weights = skin.nodes[chosen], skin.weights[chosen]
        untwisted = np.tile([0.0, 0.0, 0.0, 1.0], (len(tree.positions), 1))
        self.at_rest = self.heights(tree.positions, untwisted) - float(vertices[:, 1].min())

    def heights(self, positions: Array, rotations: Array) -> Array:
        """Return the heights (F,) [m] of the soles; of a foot without a surface, of its ankle.

        Args:
            positions: (K, 3) [m] of the posed nodes.
            rotations: (K, 4) of the posed nodes.
        """
        lows: Array = positions[self._ankles, 1]
        _lowest(
            self._points,
            self._nodes,
            self._weights,
            self._ends,
            self._rest,
            positions,
            rotations,
            lows,
        )
        return lows


@kernel
def _lowest(
    points: Array,
    nodes: Ints,
    weights: Array,
    ends: Ints,
    rest: Array,
    positions: Array,
    rotations: Array,
    lows: Array,
) -> None:
    """Write the height of the lowest point of each foot; of one without points let it be."""
    for foot in range(len(lows)):
        lowest = np.inf
        for i in range(ends[foot], ends[foot + 1]):
            height = 0.0
            for k in range(nodes.shape[1]):
                if weights[i, k] > 0.0:
                    node = nodes[i, k]
                    own = rotate(
                        quaternion(rotations, node), minus(point(points, i), point(rest, node))
                    )
                    height += weights[i, k] * (positions[node, 1] + own[1])
            lowest = min(lowest, height)
        if ends[foot + 1] > ends[foot]:
            lows[foot] = lowest


def _undermost(points: Array) -> Ints:
    """Those of some points (n, 3) that are lowest when all are tilted by up to 90 degrees."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    spiral = np.arange(_TILTS)
    rise = (spiral + 0.5) / _TILTS
    level, turn = np.sqrt(1.0 - rise * rise), _GOLDEN * spiral
    ways = np.stack([level * np.cos(turn), -rise, level * np.sin(turn)], axis=1)
    return np.unique((points @ ways.T).argmax(axis=0))
