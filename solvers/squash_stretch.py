"""Squash and stretch: ARAP deformation whose cells may scale while the volume is kept.

Source: Celikcan, Yaz and Capin 2015, section 4. Two states share one factor:

- The shape state. Cells rotate and scale uniformly, eqs. (4) to (9). This state continues from
  frame to frame. The pose state never changes it, so nothing drifts.
- The pose state, once a frame. Each cell is scaled along its primary axis as the shape state found,
  and across the axis so that the cell's volume stays: eqs. (10) to (13).

Differences from the paper:

- The primary axis lies in the cell's own plane. It is the direction of the larger of the two
  principal stretches of the cell's rest edges, not the first eigenvector of eq. (11). Both agree
  where a cell is stretched. Where a cell only bends, eq. (11) finds the normal, along which no rest
  edge has a length to scale. The two principal stretches have a closed form (2 x 2).
- Energy (4) makes both stretches nearly equal (a conformal map costs nothing), so the axis would
  flicker. The scale is then shared between both axes, smoothly.
- A pressure restores the volume that the pose still lacks. Held ends, and cells that shrink as
  eq. (4) allows, lose a third of the volume of a squashed box in spite of eq. (13). The pressure
  acts only where cells are strained, in proportion to the strain. Parts at rest stay as they are:
  no balloon effect (the paper's figure 6).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from solvers.arap import ArapSolver
from solvers.deform.arap_cells import SPOKES
from solvers.deform.cell_planes import cell_planes, vertex_normals
from solvers.deform.closed_shells import build_shells
from solvers.deform.solver_state import DeformationState
from solvers.deform.squash_kernels import (
    Fit,
    fit_pose_cells,
    fit_scaled_cells,
    pose_cells,
    rest_covariances,
    scale_cells,
)
from solvers.deform.volume_kernels import (
    add_scaled,
    find_pressures,
    push,
    strain_cells,
    sum_parts,
    volume_terms,
)
from solvers.linear.laplacian import Floats

_LARGEST_GAIN = 10.0


class SquashStretchSolver(ArapSolver):
    """Deforms a surface like `ArapSolver`, but its cells may scale and its volume is kept.

    Args:
        vertices, faces, handles, energy, groups, weights: as of `ArapSolver`.
        volume_gain: the share of the volume lost by squash and stretch that is restored, the
            paper's lambda_v: 0 none, 1 all, more exaggerates; may be changed between solves.
        cartoon: 0 for the rigid answer of `ArapSolver`, bit for bit, 1 for squash and stretch, or a
            value between; may be changed between solves.

    Raises:
        ValueError: as `ArapSolver`, and for a gain outside [0, 10] or a cartoon outside [0, 1].

    Source: Celikcan, Yaz and Capin 2015, section 4.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        handles: ArrayLike,
        *,
        energy: str = SPOKES,
        groups: ArrayLike | None = None,
        weights: ArrayLike | None = None,
        volume_gain: float = 1.0,
        cartoon: float = 1.0,
    ) -> None:
        self.volume_gain = volume_gain
        self.cartoon = cartoon
        super().__init__(vertices, faces, handles, energy=energy, groups=groups, weights=weights)
        count = len(self._rest)
        self._cell_scales, self._scales = np.ones(count), np.ones(count)
        self._VR = np.empty((count, 9))
        rest = Fit(self._VR, self._scales, self._laplace_x, self._room)
        rest_covariances(self._rest, self._mesh.cells, rest)
        self._planes = cell_planes(
            self._VR.reshape(-1, 3, 3), vertex_normals(self._rest, self._layout.faces)
        )
        self._shell = build_shells(self._rest, self._layout.faces, self._layout.parts)
        parts = int(self._layout.parts.max()) + 1
        self._strains = np.zeros(count)
        self._pose = self._rest.copy()
        self._push = np.zeros((count, 3))
        self._swell = np.zeros((count, 3))
        self._chunk_terms = np.zeros((len(self._shell.parts), 5))
        self._sums = np.zeros((parts, 5))
        self._shape_volumes = np.zeros(parts)
        self._pressures = np.zeros(parts)
        self._rest_sizes = self._measure_rest()

    @property
    def volume_gain(self) -> float:
        """The share of the lost volume that is restored: 0 none, 1 all, more exaggerates."""
        return self._volume_gain

    @volume_gain.setter
    def volume_gain(self, gain: float) -> None:
        if not 0.0 <= gain <= _LARGEST_GAIN:
            raise ValueError(f"expected a volume_gain in [0, {_LARGEST_GAIN:g}], got {gain}")
        self._volume_gain = float(gain)

    @property
    def cartoon(self) -> float:
        """How much cells may scale: 0 is rigid, 1 is squash and stretch."""
        return self._cartoon

    @cartoon.setter
    def cartoon(self, share: float) -> None:
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"expected a cartoon in [0, 1], got {share}")
        self._cartoon = float(share)

    def solve(
        self, targets: ArrayLike, iterations: int = 1, *, out: Floats | None = None
    ) -> Floats:
        """Return vertices (N, 3) whose handles are at `targets` (H, 3); hard handles exactly.

        The last iteration is the pose state's, all others are the shape state's. One iteration is
        one of each. Zero returns the start itself. `out` as of `ArapSolver.solve`.

        Raises:
            ValueError: as of `ArapSolver.solve`.
        """
        if self._cartoon > 0.0 and iterations > 1:
            iterations -= 1
        return super().solve(targets, iterations, out=out)

    def reset(self) -> None:
        """Forget the last answer: the next solve starts from the rest pose."""
        super().reset()
        self._cell_scales[:] = 1.0

    def snapshot(self) -> DeformationState:
        """Return what the next solve depends on, as of `ArapSolver.snapshot`.

        Each solve computes the pose state from the shape state, so the snapshot leaves it out.
        """
        return replace(super().snapshot(), cell_scales=self._cell_scales.copy())

    def restore(self, state: DeformationState) -> None:
        """Go back to a snapshot, as of `ArapSolver.restore`.

        `scales` and `cell_matrices` are valid again after the next solve.
        """
        super().restore(state)
        self._cell_scales[:] = 1.0 if state.cell_scales is None else state.cell_scales

    @property
    def energy(self) -> float:
        """The energy (4) of the shape state with its best rotations and scales.

        It includes the active terms between rotations; in the vertices' unit squared.
        """
        kept = self._R.copy(), self._cell_scales.copy()
        self._local_step(self._x)
        energy = self._sum_terms(self._x)
        self._unscale()
        energy += self._priors.energy(self._R)
        self._R[:], self._cell_scales[:] = kept
        return energy * self._box.size**2

    def rotations(self) -> Floats:
        """Return each cell's rotation after the last iteration, without its scale, (N, 3, 3)."""
        scaled = super().rotations()
        return scaled / self._cell_scales[self._layout.place][:, None, None]

    def cell_matrices(self) -> Floats:
        """Return the matrices V R that turn and stretch the cells in the last pose, (N, 3, 3)."""
        if self._cartoon == 0.0:
            return self.rotations()
        return self._VR[self._layout.place].reshape(-1, 3, 3)

    @property
    def scales(self) -> Floats:
        """The scale of each vertex's cell along its primary axis, (N,)."""
        return self._scales[self._layout.place]

    def _local_step(self, x: Floats) -> None:
        if self._priors.is_on:  # the priors compare rotations without scales
            self._unscale()
        super()._local_step(x)
        if self._priors.is_on and self._cartoon > 0.0:
            fit = Fit(self._R, self._cell_scales, self._laplace_x, self._room)
            scale_cells(x, self._mesh.cells, self._planes, self._cartoon, fit)

    def _fit(self, x: Floats, priors: Floats) -> None:
        if self._cartoon == 0.0 or len(priors):
            super()._fit(x, priors)
            self._cell_scales[:] = 1.0
        else:
            fit = Fit(self._R, self._cell_scales, self._laplace_x, self._room)
            fit_scaled_cells(x, self._mesh.cells, self._planes, self._cartoon, fit)

    def _unscale(self) -> None:
        """Take the scales out of the cells' matrices."""
        self._R /= self._cell_scales[:, None]
        self._cell_scales[:] = 1.0

    def _pose_step(self) -> Floats:
        """The surface to show, from the shape state, which does not change."""
        if self._cartoon == 0.0:
            return self._x
        gain = self._volume_gain * self._cartoon
        fit = Fit(self._VR, self._scales, self._laplace_x, self._room)
        if self._priors.is_on:
            self._local_step(self._x)
            np.divide(self._R, self._cell_scales[:, None], out=self._VR)
            pose_cells(self._x, self._mesh.cells, self._planes, gain, fit)
        else:
            fit_pose_cells(self._x, self._mesh.cells, self._planes, gain, fit)
        shape, sR = self._x, self._R
        self._pose[:] = shape
        self._x, self._R = self._pose, self._VR
        self._global_step()
        self._x, self._R = shape, sR
        if gain > 0.0:
            self._keep_volume(gain)
        return self._pose

    def _keep_volume(self, gain: float) -> None:
        """Expand the pose where it is squashed, and contract it where it is stretched."""
        self._swell[:] = 0.0
        if gain > 1.0:
            self._measure(self._x)
            self._shape_volumes[:] = self._sums[:, 0]
        strain_cells(self._scales, self._strains)
        push(self._pose, self._shell, self._strains, self._system.constraints.fixed, self._push)
        self._system.add_solution(self._push, self._swell)
        self._measure(self._pose)
        find_pressures(self._sums, self._rest_sizes, self._shape_volumes, gain, self._pressures)
        add_scaled(self._pressures, self._layout.parts, self._swell, self._pose)

    def _measure(self, x: Floats) -> None:
        """Sum the volume terms of each component at x (N, 3)."""
        volume_terms(x, self._swell, self._shell, self._strains, self._chunk_terms)
        sum_parts(self._chunk_terms, self._shell.parts, self._sums)

    def _measure_rest(self) -> Floats:
        """Each component's volume and area at rest, (C, 2)."""
        self._measure(self._rest)
        part_of_face = self._layout.parts[self._shell.faces[:, 0]]
        areas = np.bincount(part_of_face, self._shell.areas, minlength=len(self._sums))
        return np.column_stack([self._sums[:, 0], areas])
