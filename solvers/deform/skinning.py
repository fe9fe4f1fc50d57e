"""Dual quaternion skinning: a surface follows the nodes of a skeleton by its skin weights.

Each node has a rigid motion from rest. A vertex follows the blend of the motions of up to four
nodes as dual quaternions (Kavan et al. 2008, Geometric skinning with approximate dual quaternion
blending, section 3): the blend is rigid itself, so a twisted limb keeps its radius. Of the two
quaternions of each rotation the one nearer to that of the vertex's strongest node counts.

Where two nodes are turned by half a turn against each other, none is nearer, and the blend would
leap to the other side of the limb as they pass it. Near there the mean of their motions (linear
blend skinning) takes its place: it is narrow, but it does not leap.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import prange
from numpy.typing import NDArray

from solvers.deform.handle_motion import KEPT, Influences, follow, path
from solvers.kernels.compiled import kernel, parallel_kernel, threads_for
from solvers.kernels.quaternion import Vector, matrix, normalized
from solvers.kernels.vector import point
from solvers.linear.laplacian import Floats
from solvers.surface.skin_weights import Skin

_NEARLY: Final = 0.25  # cosine of half the angle between two nodes below which the mean counts
_COUNTS: Final = 0.1  # weight from which on a node counts in full for that


class SkinnedSurface:
    """A surface of C vertices that follows the K nodes of a skeleton.

    Args:
        vertices: (C, 3) rest positions, any unit.
        nodes: (K, 3) rest positions of the nodes.
        skin: which nodes each vertex follows, at most `KEPT` of them count.
    """

    def __init__(self, vertices: Floats, nodes: Floats, skin: Skin) -> None:
        self._rest = np.ascontiguousarray(vertices, dtype=np.float64)
        self._nodes = np.ascontiguousarray(nodes, dtype=np.float64)
        strong = skin.strongest(KEPT)
        groups = np.zeros((len(vertices), KEPT), dtype=np.uint32)
        weights = np.zeros(groups.shape)
        groups[:, : strong.nodes.shape[1]] = strong.nodes
        weights[:, : strong.nodes.shape[1]] = strong.weights
        order = np.argsort(-weights, axis=1, kind="stable")  # the strongest decides the signs
        self._influences = Influences(
            np.take_along_axis(groups, order, axis=1), np.take_along_axis(weights, order, axis=1)
        )
        self._motions = np.empty((len(nodes), 8))

    def place(self, positions: Floats, rotations: Floats) -> Floats:
        """Return where the vertices (C, 3) are when the nodes are posed; a new array.

        Args:
            positions: (K, 3) of the nodes.
            rotations: (K, 4) of the nodes from rest, quaternions (x, y, z, w) of any length.
        """
        placed = np.empty_like(self._rest)
        _motions_of_nodes(self._nodes, positions, rotations, self._motions)
        with threads_for(len(placed)):
            follow(self._rest, self._influences, self._motions, placed)
            groups, weights = self._influences.groups, self._influences.weights
            _mean_near_half_turns(self._rest, groups, weights, self._motions, placed)
        return placed


@parallel_kernel
def _mean_near_half_turns(
    x: Floats, groups: NDArray[np.uint32], weights: Floats, motions: Floats, out: Floats
) -> None:
    """Move what has been placed in `out` (N, 3) to the mean of its nodes' motions, as need be."""
    for i in prange(len(groups)):
        first, share = groups[i, 0], 0.0
        for k in range(1, KEPT):
            g, cosine = groups[i, k], 0.0
            for axis in range(4):
                cosine += motions[first, axis] * motions[g, axis]
            own = (1.0 - abs(cosine) / _NEARLY) * min(weights[i, k] / _COUNTS, 1.0)
            share = max(share, own)
        if share <= 0.0:
            continue
        rest = point(x, i)
        a, b, c = rest
        for k in range(KEPT):
            m = motions[groups[i, k]]
            moved = path((m[0], m[1], m[2], m[3]), (m[4], m[5], m[6], m[7]), rest)
            a += weights[i, k] * moved[0]
            b += weights[i, k] * moved[1]
            c += weights[i, k] * moved[2]
        out[i, 0] += share * (a - out[i, 0])
        out[i, 1] += share * (b - out[i, 1])
        out[i, 2] += share * (c - out[i, 2])


@kernel
def _motions_of_nodes(rest: Floats, positions: Floats, rotations: Floats, out: Floats) -> None:
    """The motions x -> R (x - rest) + position as unit dual quaternions (K, 8), scalars first."""
    for k in range(len(rest)):
        q = normalized((rotations[k, 0], rotations[k, 1], rotations[k, 2], rotations[k, 3]))
        R = matrix(q)
        x, y, z, w = q
        t0 = 0.5 * (positions[k, 0] - _along(R[0], rest[k]))
        t1 = 0.5 * (positions[k, 1] - _along(R[1], rest[k]))
        t2 = 0.5 * (positions[k, 2] - _along(R[2], rest[k]))
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = w, x, y, z
        out[k, 4] = -t0 * x - t1 * y - t2 * z
        out[k, 5] = t0 * w + t1 * z - t2 * y
        out[k, 6] = t1 * w + t2 * x - t0 * z
        out[k, 7] = t2 * w + t0 * y - t1 * x


@kernel
def _along(row: Vector, x: Floats) -> float:
    """The product of a row with a vector (3,)."""
    return float(row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
