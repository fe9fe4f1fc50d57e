"""Strain energy and inverted triangles of a deformed surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.deform.arap_cells import SPOKES, build_cells
from solvers.deform.arap_kernels import fit_cells
from solvers.deform.rotation_fit import SCRATCH
from solvers.kernels.compiled import kernel, most_threads, threads_for
from solvers.linear.laplacian import half_cotangents

SLIVER = 0.02  # height over longest side: the normal of a flatter triangle is noise

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


class SurfaceQuality:
    """Measures deformed positions of one surface against its rest positions.

    A triangle is inverted when its normal points against its normal at rest, turned by the mean of
    its corners' cell rotations (the best rigid turn of the edges around each, Sorkine and Alexa
    2007, eq. (6)). A sharp bend is not inverted; a triangle folded over its neighbours is. Slivers,
    at rest or now, are never inverted: their normals are noise.

    The energy is sum A (s1 - 1)^2 + A (s2 - 1)^2 over triangles of rest area A and singular values
    s1, s2 (the second negative where inverted), over the whole area: no unit, any mesh (Liu et al.
    2008, A local/global approach to mesh parameterization, eq. (2)).

    Args:
        vertices: (N, 3) rest positions, any unit.
        faces: (F, 3) triangles.

    Attributes:
        energy: of the last measured positions: 0 at rest, about the square of a typical strain.
        inverted: (F',) whether each triangle that is no sliver at rest is inverted.
    """

    def __init__(self, vertices: Array, faces: Indices) -> None:
        rest = np.ascontiguousarray(vertices, np.float64)
        self._faces, self._normals, self._areas = _sound(rest, faces)
        self._halves = half_cotangents(rest, self._faces)
        self._cells = build_cells(rest, np.asarray(faces, np.int64), SPOKES).cells
        self._R = np.empty((len(rest), 9))
        self._unused = np.empty((len(rest), 3))
        self._room = np.empty((most_threads(), SCRATCH))
        self.inverted = np.zeros(len(self._faces), np.bool_)
        self.measure(rest)  # compiles now, or loads what an earlier run compiled

    def measure(self, vertices: Array) -> None:
        """Update `energy` and `inverted` for deformed positions (N, 3)."""
        x = np.ascontiguousarray(vertices, np.float64)
        with threads_for(len(x)):
            fit_cells(x, self._cells, self._R, self._unused, self._room)
        faces = self._faces, self._normals, self._areas, self._halves
        energy = _measure_faces(x, faces, self._R, self.inverted)
        area = float(self._areas.sum())
        self.energy = energy / area if area > 0.0 else 0.0


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
def _measure_faces(
    x: Array, rest: tuple[Indices, Array, Array, Array], R: Array, inverted: Flags
) -> float:
    """The energy of all faces (F,); writes which of them are inverted (F,)."""
    faces, normals, areas, halves = rest
    energy = 0.0
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
        inverted[f] = is_inverted
    return energy
