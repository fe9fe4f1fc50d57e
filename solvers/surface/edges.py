"""The edges of a triangle mesh, and how much a deformation stretches them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SHORTEST = 1e-9  # of the mesh's extent; the stretch of a shorter edge is undefined


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """All edges of a mesh with a length at rest, each once.

    Attributes:
        ends: (E, 2) their vertices, the lower index first, in order.
        lengths: (E,) at rest, in the vertices' unit.
    """

    ends: Indices
    lengths: Array

    @classmethod
    def of(cls, vertices: Array, faces: Indices) -> Self:
        """Find the edges of a mesh, vertices (N, 3) at rest and faces (F, 3)."""
        tails = np.asarray(faces, dtype=np.int64)
        heads = np.roll(tails, -1, axis=1)
        count = max(len(vertices), 1)
        keys = np.sort((np.minimum(tails, heads) * count + np.maximum(tails, heads)).ravel())
        keys = keys[np.diff(keys, prepend=-1) > 0]  # np.unique hashes first: twice the time
        ends = np.stack([keys // count, keys % count], axis=1)
        lengths = _lengths(vertices, ends)
        extent = np.ptp(vertices, axis=0).max(initial=0.0) if len(vertices) else 0.0
        kept = lengths > SHORTEST * extent
        return cls(ends[kept], lengths[kept])

    def stretch(self, points: Array) -> Array:
        """Return the relative change |l / l0 - 1| of each edge (E,) for vertices (N, 3)."""
        out = _lengths(points, self.ends)
        out /= self.lengths
        out -= 1.0
        return np.abs(out, out=out)


def _lengths(points: Array, ends: Indices) -> Array:
    out = np.empty(len(ends))
    _measure(np.ascontiguousarray(points, np.float64), ends, out)
    return out


@kernel
def _measure(points: Array, ends: Indices, out: Array) -> None:
    for e in range(len(ends)):
        i, j = ends[e, 0], ends[e, 1]
        x = points[i, 0] - points[j, 0]
        y = points[i, 1] - points[j, 1]
        z = points[i, 2] - points[j, 2]
        out[e] = math.sqrt(x * x + y * y + z * z)
