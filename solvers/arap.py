"""As-rigid-as-possible deformation, warm-started and prefactored, for every frame of a performance.

Sorkine and Alexa 2007, As-rigid-as-possible surface modeling; Chao et al. 2010, A simple geometric
model for elastic deformations, for the energy with rims. Three things are added.

- The start. The last answer first moves along with the handles (`solvers.handle_motion`), so that a
  rigid motion of all handles is the answer at once. After a jump the rest pose, moved along, is
  taken instead if it is nearer to rigid: a bad frame leaves nothing behind.
- The unknown. The global step solves for the correction of the positions, from a residual in double
  precision, so the error of the solve is relative to the correction, not to the character.
- The parts that no handle touches. A component without a handle is nobody's to bend: it is carried
  rigidly by the nearest group of handles, and so is a vertex without a face.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from solvers.arap_cells import SPOKES, SPOKES_AND_RIMS, build_cells
from solvers.arap_kernels import energy_terms, fit_cells, place_outside, residual
from solvers.arap_layout import (
    Frame,
    Layout,
    checked_handles,
    checked_mesh,
    checked_targets,
    lay_out,
)
from solvers.block_factor import BlockFactor
from solvers.handle_motion import (
    Influences,
    farthest_motion,
    fit_motions,
    follow,
    follow_one_group,
    harmonic_influences,
)
from solvers.laplacian import Floats, Ints

# A group that turned or went further than this between two frames has jumped: radians, and shares
# of the character's size.
_JUMP_ANGLE = math.radians(30.0)
_JUMP_PATH = 0.1

# The rest pose must start this much nearer to rigid before it takes the last answer's place.
_BETTER = 0.9


class ArapSolver:
    """Deforms a surface so that its handles meet their targets and its cells stay rigid.

    Args:
        vertices: rest positions (N, 3), any unit, finite.
        faces: triangles (F, 3); boundaries, non-manifold edges, zero-area faces, vertices without
            faces and several components are all fine.
        handles: vertex indices (H,), at least one, each once.
        energy: "spokes" (Sorkine and Alexa 2007) or "spokes-and-rims" (Chao et al. 2010).
        groups: which handles move rigidly together, any integers (H,); all of them by default.

    Raises:
        ValueError: for wrong shapes, indices out of range, numbers that are not finite, an unknown
            energy, or handles that are missing or repeated.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        handles: ArrayLike,
        *,
        energy: str = SPOKES,
        groups: ArrayLike | None = None,
    ) -> None:
        points, triangles = checked_mesh(vertices, faces)
        chosen, self._group_of, self._group_count = checked_handles(handles, groups, len(points))
        if energy not in (SPOKES, SPOKES_AND_RIMS):
            raise ValueError(f"unknown energy {energy!r}: use {SPOKES!r} or {SPOKES_AND_RIMS!r}")
        self._frame = Frame.around(points)
        self._layout = layout = lay_out(points, triangles, chosen)
        self._rest = np.ascontiguousarray(self._frame.inside(points)[layout.order])
        self._mesh = build_cells(self._rest[: layout.active], layout.faces, energy)
        self._factor = BlockFactor(
            sp.csr_matrix(self._mesh.laplacian[: layout.free, : layout.free]), layout.tree
        )
        self._influences = self._find_influences()
        self._carriers = _nearest_groups(self._rest, layout, self._group_of)
        self._R = np.empty((layout.active, 9))
        self._laplace_x = np.empty((layout.active, 3))
        self._residual = np.empty((layout.free, 3))
        self._x = self._rest.copy()
        self._from_rest = np.empty_like(self._rest)
        self._energy_terms = np.empty(len(self._mesh.terms.cells))

    def reset(self) -> None:
        """Forget the last answer: the next solve starts from the rest pose."""
        self._x[:] = self._rest

    def solve(self, targets: ArrayLike, iterations: int = 1) -> Floats:
        """Vertices (N, 3) that bring the handles to `targets` (H, 3), exactly.

        Starts from the last answer, moved along with the handles, and takes `iterations` local and
        global steps from there; zero gives the start itself.

        Raises:
            ValueError: for targets of a wrong shape, not finite, or absurdly far away.
        """
        layout = self._layout
        goals = checked_targets(targets, layout.active - layout.free, self._frame)
        if iterations < 0:
            raise ValueError(f"iterations must not be negative, got {iterations}")
        self._move_along(self._frame.inside(goals))
        for _ in range(iterations):
            self._local_step(self._x)
            self._global_step()
        answer = np.empty_like(self._x)
        place_outside(self._x, layout.order, self._frame.centre, self._frame.size, answer)
        answer[layout.order[layout.free : layout.active]] = goals
        return answer

    @property
    def energy(self) -> float:
        """The energy of the last answer under its best rotations, in the vertices' unit squared."""
        return self._energy_of(self._x) * self._frame.size**2

    def _local_step(self, x: Floats) -> None:
        fit_cells(x, self._mesh.cells, self._R, self._laplace_x)

    def _global_step(self) -> None:
        residual(self._R, self._laplace_x, self._mesh.cells, self._residual)
        self._factor.add_solution(self._residual, self._x)

    def _move_along(self, goals: Floats) -> None:
        """Put the start of this frame's iterations into x: handles at their goals, (H, 3)."""
        free, active = self._layout.free, self._layout.active
        handles = slice(free, active)
        here = self._x[handles].copy()
        step = fit_motions(here, goals, self._group_of, self._group_count)
        follow(self._x[:free], self._influences, step, self._x[:free])
        self._x[handles] = goals
        angle, path = farthest_motion(step, here, self._group_of)
        has_jumped = angle > _JUMP_ANGLE or path > _JUMP_PATH
        if not has_jumped and active == len(self._rest):
            return
        whole = fit_motions(self._rest[handles], goals, self._group_of, self._group_count)
        follow(self._rest[active:], self._carriers, whole, self._x[active:])
        if has_jumped:
            follow(self._rest[:free], self._influences, whole, self._from_rest[:free])
            self._from_rest[handles] = goals
            if self._energy_of(self._from_rest) < _BETTER * self._energy_of(self._x):
                self._x[:active] = self._from_rest[:active]

    def _energy_of(self, x: Floats) -> float:
        self._local_step(x)
        energy_terms(x, self._R, self._rest, self._mesh.terms, self._energy_terms)
        return float(self._energy_terms.sum())

    def _find_influences(self) -> Influences:
        free, active = self._layout.free, self._layout.active
        coupling = -self._mesh.laplacian[:free, free:active]
        return harmonic_influences(
            self._factor.solve, sp.csr_matrix(coupling), self._group_of, self._group_count
        )


def _nearest_groups(rest: Floats, layout: Layout, group_of: Ints) -> Influences:
    """For each carried vertex, the group of the handle nearest to its component."""
    carried = np.arange(layout.active, len(rest))
    if not len(carried):
        return follow_one_group(np.zeros(0, dtype=np.int64))
    distance, handle = KDTree(rest[layout.free : layout.active]).query(rest[carried])
    part_of = layout.parts[carried]
    nearest_first = np.lexsort((carried, distance))
    _, where = np.unique(part_of[nearest_first], return_index=True)
    nearest = np.zeros(layout.parts.max() + 1, dtype=np.int64)
    nearest[part_of[nearest_first][where]] = group_of[handle[nearest_first][where]]
    return follow_one_group(nearest[part_of])


def warm() -> None:
    """Compile what a performance will call, so that no frame waits for it; it is cached on disk.

    Takes under a minute on a fresh machine, a moment after that.
    """
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0), [0.0]), axis=-1).reshape(-1, 3)
    a = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 10], 1), np.stack([a, a + 10, a + 9], 1)])
    solver = ArapSolver(grid, faces, [0, 8, 72, 80])
    solver.solve(grid[[0, 8, 72, 80]][::-1], 1)  # a jump, which compiles the energy too
