"""Whether a surface is in good order while it performs: energy, stretch, and inverted triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.deform.arap_cells import SPOKES, build_cells
from solvers.deform.arap_kernels import fit_cells
from solvers.deform.rotation_fit import SCRATCH
from solvers.kernels.compiled import kernel, most_threads, threads_for
from solvers.linear.laplacian import half_cotangents
from solvers.signal.histogram import count, percentile
from solvers.signal.streaming_median import StreamingMedian

EACH_FRAME = 4_000  # vertices; a larger surface is looked at every so many frames
SLIVER = 0.02  # height over longest side: the normal of a flatter triangle is noise
_BIN = 0.005  # of stretch
_BINS = 2001  # more than ten counts as ten

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Finding:
    """What one look at a surface found.

    Attributes:
        energy: as-rigid-as-possible energy of the triangles over the area at rest: 0 at rest, about
            the square of a typical strain.
        stretch_p99: 99th percentile of the edges' relative change of length.
        stretch_max: the largest.
        inverted: how many triangles point against what is around them.
        longest: for how many frames the longest inverted of them has been so.
    """

    energy: float
    stretch_p99: float
    stretch_max: float
    inverted: int
    longest: int


class Watchdog:
    """Looks at a deforming surface, frame by frame, and keeps what it found.

    A triangle is inverted when its normal points against its normal at rest, turned by the mean of
    its corners' cell rotations (the best rigid turn of the edges around each, Sorkine and Alexa
    2007, eq. (6)): a sharp bend is none, a triangle folded over its neighbours is. It must have
    some height, at rest and now: slivers have no normal worth the name.

    The energy is sum A (s1 - 1)^2 + A (s2 - 1)^2 over triangles of rest area A and singular values
    s1, s2 (the second negative where inverted), over the whole area: no unit, any mesh (Liu et al.
    2008, A local/global approach to mesh parameterization, eq. (2)).

    A surface of more than `EACH_FRAME` vertices is looked at only now and then; its figures then
    count in frames all the same.

    Args:
        vertices: (N, 3) [m] rest positions.
        faces: (F, 3) triangles.

    Attributes:
        last: what the last look found; None before the first.
    """

    def __init__(self, vertices: Array, faces: Indices) -> None:
        rest = np.ascontiguousarray(vertices, np.float64)
        self._faces, self._normals, self._areas = _sound(rest, faces)
        self._halves = half_cotangents(rest, self._faces)
        self._cells = build_cells(rest, np.asarray(faces, np.int64), SPOKES).cells
        self._R = np.empty((len(rest), 9))
        self._unused = np.empty((len(rest), 3))
        self._room = np.empty((most_threads(), SCRATCH))
        self._runs = np.zeros(len(self._faces), np.int64)
        self._counts = np.zeros(_BINS, np.int64)
        self._stride = max(1, -(-len(rest) // EACH_FRAME))
        self._frames = self._looks = self._bad_looks = 0
        self._energies = StreamingMedian()
        self._worst = Finding(0.0, 0.0, 0.0, 0, 0)
        self.last: Finding | None = None
        self._look(rest, np.zeros(0))  # compiles now, or loads what an earlier run compiled
        self._runs[:] = 0

    def add(self, vertices: Array, stretch: Array) -> None:
        """Look at one deformed surface, if it is its turn.

        Args:
            vertices: (N, 3) [m].
            stretch: (E,) relative change of the length of its edges.
        """
        if self._frames % self._stride == 0:
            self.last = found = self._look(np.ascontiguousarray(vertices, np.float64), stretch)
            self._looks += 1
            self._bad_looks += found.inverted > 0
            self._energies.add(found.energy)
            worst = self._worst
            self._worst = Finding(
                max(worst.energy, found.energy),
                max(worst.stretch_p99, found.stretch_p99),
                max(worst.stretch_max, found.stretch_max),
                max(worst.inverted, found.inverted),
                max(worst.longest, found.longest),
            )
        self._frames += 1

    def _look(self, x: Array, stretch: Array) -> Finding:
        with threads_for(len(x)):
            fit_cells(x, self._cells, self._R, self._unused, self._room)
        energy, inverted, longest = _judge_faces(
            x,
            (self._faces, self._normals, self._areas, self._halves),
            self._R,
            self._stride,
            self._runs,
        )
        self._counts[:] = 0
        count(stretch, _BIN, self._counts)
        most = float(stretch.max(initial=0.0))
        area = float(self._areas.sum())
        return Finding(
            energy=energy / area if area > 0.0 else 0.0,
            stretch_p99=float(percentile(self._counts, _BIN, 99.0)),
            stretch_max=most if most < np.inf else np.inf,  # also when it is not a number
            inverted=inverted,
            longest=longest,
        )

    def summary(self) -> dict[str, Any]:
        """The report's part ``watchdog``.

        ``energy`` {p50, max}, ``stretch`` {p99, max}: of the worst frame and the worst edge,
        ``inverted`` {max, last, longest, frames}: triangles in the worst frame and the last, the
        frames that the same triangle stayed inverted at most, and the frames that had any.
        """
        worst, last = self._worst, self.last
        return {
            "energy": {"p50": self._energies.median, "max": worst.energy},
            "stretch": {"p99": worst.stretch_p99, "max": worst.stretch_max},
            "inverted": {
                "max": worst.inverted,
                "last": 0 if last is None else last.inverted,
                "longest": worst.longest,
                "frames": min(self._bad_looks * self._stride, self._frames),
            },
        }


def _sound(rest: Array, faces: Indices) -> tuple[Indices, Array, Array]:
    """The faces (F', 3) that are no slivers, their unit normals (F', 3) and areas (F',)."""
    corners = rest[faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    longest = sides.max(axis=1, initial=0.0)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    is_sound = doubled > SLIVER * longest**2
    normals, doubled = normals[is_sound], doubled[is_sound]
    kept = np.ascontiguousarray(faces[is_sound], np.int64)
    return kept, normals / doubled[:, None], 0.5 * doubled


@kernel
def _judge_faces(
    x: Array,
    rest: tuple[Indices, Array, Array, Array],
    R: Array,
    frames: int,
    runs: Indices,
) -> tuple[float, int, int]:
    """The energy of all faces, how many are inverted, and the longest of their `runs` (F,)."""
    faces, normals, areas, halves = rest
    energy, inverted, longest = 0.0, 0, 0
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        u0, u1, u2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        v0, v1, v2 = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        n0, n1, n2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
        uu, vv = u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2
        ww = uu + vv - 2.0 * (u0 * v0 + u1 * v1 + u2 * v2)
        doubled = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        m0, m1, m2 = normals[f, 0], normals[f, 1], normals[f, 2]
        along = 0.0
        for row in range(3):
            k = 3 * row
            t = (
                (R[a, k] + R[b, k] + R[c, k]) * m0
                + (R[a, k + 1] + R[b, k + 1] + R[c, k + 1]) * m1
                + (R[a, k + 2] + R[b, k + 2] + R[c, k + 2]) * m2
            )
            along += t * (n0 if row == 0 else n1 if row == 1 else n2)
        is_inverted = along < 0.0 and doubled > SLIVER * max(uu, vv, ww)
        area = areas[f]
        stretched = halves[f, 0] * ww + halves[f, 1] * vv + halves[f, 2] * uu
        signed = -doubled if is_inverted else doubled
        both = np.sqrt(max(area * (stretched + signed), 0.0))
        energy += max(stretched + 2.0 * area - 2.0 * both, 0.0)
        runs[f] = runs[f] + frames if is_inverted else 0
        inverted += is_inverted
        longest = max(longest, runs[f])
    return energy, inverted, longest
