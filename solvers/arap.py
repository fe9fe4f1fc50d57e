"""As-rigid-as-possible (ARAP) deformation of a triangle mesh, fast enough for every live frame.

Sources: Sorkine and Alexa 2007, As-rigid-as-possible surface modeling; Chao et al. 2010, A simple
geometric model for elastic deformations, for the energy with rims. The solver adds four things:

- A start near the answer. The last answer first moves along with the handles
  (`solvers.deform.handle_motion`), so a rigid motion of all handles needs no iteration. After a
  jump the solver also tries the rest pose (`solvers.deform.rest_pose_trials`), so a bad frame has
  no effect on later frames. Or the caller knows a start, such as a skinned surface: `relax`.
- A correction as the unknown, from a residual in double precision: the error of the solve is
  relative to the correction, not to the size of the character.
- Optional terms between rotations: smooth rotations for few handles, and stiff limbs
  (`solvers.deform.rotation_priors`).
- Parts without a handle. The nearest group of handles carries such a component, or a vertex without
  a face, rigidly (`solvers.deform.carried_parts`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.deform.arap_cells import SPOKES, SPOKES_AND_RIMS, build_cells, surface_area
from solvers.deform.arap_kernels import energy_terms, fit_cells, place_outside, pull_soft, residual
from solvers.deform.arap_layout import (
    UnitBox,
    check_steps,
    checked_mesh,
    checked_regions,
    checked_targets,
    lay_out,
)
from solvers.deform.carried_parts import CarriedParts
from solvers.deform.creases import Creases
from solvers.deform.handle_influence import HandleInfluence
from solvers.deform.handle_motion import farthest_motion, follow
from solvers.deform.handles import checked_handles
from solvers.deform.rest_pose_trials import RestPoseTrials
from solvers.deform.rotation_fit import SCRATCH
from solvers.deform.rotation_priors import (
    NO_PRIORS,
    SMOOTHNESS,
    RotationPriors,
    fit_cells_near,
    turn_along,
)
from solvers.deform.solver_state import DeformationState
from solvers.kernels.compiled import most_threads, threads_for
from solvers.linear.constrained_system import ConstrainedSystem, Constraints
from solvers.linear.laplacian import Floats

SMOOTH_ROTATIONS = "smooth-rotations"
ENERGIES = (SPOKES, SPOKES_AND_RIMS, SMOOTH_ROTATIONS)

_NO_TURN = np.eye(3).ravel()


class ArapSolver:
    """Deforms a surface so that its handles meet their targets and its cells stay nearly rigid.

    Args:
        vertices: rest positions (N, 3), any unit, finite.
        faces: triangles (F, 3); boundaries, non-manifold edges, zero-area faces, vertices without
            faces and several components are all fine.
        handles: vertex indices (H,), at least one, each once.
        energy: "spokes" (Sorkine and Alexa 2007), "spokes-and-rims" (Chao et al. 2010), or
            "smooth-rotations" (Levi and Gotsman 2015), which bends evenly between few handles.
        groups: any integers (H,); handles with the same number move rigidly together. By default
            all handles are one group.
        weights: how firmly each handle is held (H,); see `hold`.

    Raises:
        ValueError: for wrong shapes, indices out of range, numbers that are not finite, an unknown
            energy, handles that are missing or repeated, or a weight below zero.
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
    ) -> None:
        points, triangles = checked_mesh(vertices, faces)
        if energy not in ENERGIES:
            raise ValueError(f"unknown energy {energy!r}: use one of {', '.join(ENERGIES)}")
        self._box = UnitBox.around(points)
        self._layout = layout = lay_out(points, triangles)
        self._handles = checked_handles(handles, groups, weights, layout)
        self._rest = np.ascontiguousarray(self._box.inside(points)[layout.order])
        self._mesh = build_cells(self._rest, layout.faces, energy)
        self._unit = float(self._mesh.laplacian.diagonal().mean()) or 1.0
        self._carried = CarriedParts.of(self._rest, self._handles, layout)
        self._system = ConstrainedSystem(self._mesh.laplacian, layout.tree, self._constraints())
        self._influence = HandleInfluence(self._system, self._handles)
        count = len(points)
        smoothing = SMOOTHNESS * surface_area(self._rest, layout.faces)
        self._priors = RotationPriors(
            self._mesh, self._rest, smoothing if energy == SMOOTH_ROTATIONS else 0.0
        )
        self._R = np.tile(_NO_TURN, (count, 1))
        self._R_aside = self._R.copy()
        self._trials = RestPoseTrials()
        self._laplace_x, self._residual = np.empty((count, 3)), np.empty((count, 3))
        self._room = np.empty((most_threads(), SCRATCH))
        self._x = self._rest.copy()
        self._shown = self._x
        self._from_rest = np.empty_like(self._rest)
        self._energy_terms = np.empty(len(self._mesh.terms.cells))
        self._goals = self._x[self._handles.places]
        self._creases: Creases | None = None

    def hold(
        self,
        handles: ArrayLike,
        *,
        groups: ArrayLike | None = None,
        weights: ArrayLike | None = None,
    ) -> None:
        """Replace the handles; the surface stays where it is.

        Args:
            handles: vertex indices (H,), at least one, each once.
            groups: any integers (H,); handles with the same number move rigidly together. By
                default all handles are one group.
            weights: how firmly each is held (H,). Infinity, the default, meets the target exactly;
                1 is a spring as stiff as the surface around a vertex; 0 lets go.

        Raises:
            ValueError: as the constructor; the solver is then unchanged.
        """
        new = checked_handles(handles, groups, weights, self._layout)
        self._goals = new.goals_after(self._handles, self._goals, self._x)
        self._handles = new
        self._carried = CarriedParts.of(self._rest, new, self._layout)
        self._system.constrain(self._constraints())
        self._influence.hold(new)

    def weigh(self, weights: ArrayLike) -> None:
        """Change how firmly the handles are held to `weights` (H,), as of `hold`.

        Raises:
            ValueError: for weights of a wrong shape or below zero; the solver is then unchanged.
        """
        self._handles = self._handles.reweighted(weights)
        self._system.constrain(self._constraints())
        self._influence.reweigh(self._handles)

    def stiffen(self, region_of: ArrayLike, rigidity: ArrayLike) -> None:
        """Define the parts of the surface that `stiffness` keeps from bending.

        Args:
            region_of: (N,) integers, the part of each vertex.
            rigidity: (N,) in [0, 1], the share of the stiffness at each vertex: 1 within a limb, 0
                where the surface may bend; see `solvers.deform.stiff_segments`.

        Raises:
            ValueError: for wrong shapes or a rigidity out of range; the solver is then unchanged.
        """
        regions, shares = checked_regions(region_of, rigidity, len(self._x))
        order = self._layout.order
        self._priors.stiffen(regions[order], shares[order])

    @property
    def stiffness(self) -> float:
        """How stiff the parts defined by `stiffen` are, in [0, 1); 0 costs no time."""
        return self._priors.stiffness

    @stiffness.setter
    def stiffness(self, share: float) -> None:
        if not 0.0 <= share < 1.0:
            raise ValueError(f"expected a stiffness in [0, 1), got {share}")
        self._priors.stiffness = float(share)

    def reset(self) -> None:
        """Forget the last answer: the next solve starts from the rest pose."""
        self._x[:] = self._rest
        self._R[:] = _NO_TURN
        self._trials = RestPoseTrials()
        self._goals = self._x[self._handles.places]

    def snapshot(self) -> DeformationState:
        """Return what the next solve depends on, besides the settings: see `DeformationState`."""
        x, R, precision = self._x.copy(), self._R.copy(), self._system.precision
        influence = self._influence.snapshot()
        creases = None if self._creases is None else self._creases.snapshot()
        return DeformationState(
            x, R, self._handles, self._goals, precision, influence, self._trials, creases
        )

    def restore(self, state: DeformationState) -> None:
        """Go back to a snapshot; the next solves return the same bytes as after the snapshot.

        The handles and weights of the snapshot are held again. If others are held now, the system
        is factored again. `flatten_folds` may be called after the next solve.

        Raises:
            ValueError: a snapshot of a surface with another number of vertices; nothing changes.
        """
        if state.positions.shape != self._x.shape:
            raise ValueError(
                f"expected a state of {len(self._x)} vertices, got {len(state.positions)}"
            )
        if state.handles is not self._handles:
            self._handles = state.handles
            self._carried = CarriedParts.of(self._rest, self._handles, self._layout)
            self._system.restore(self._constraints(), state.precision)
        self._influence.restore(state.influence)
        self._x[:], self._R[:], self._goals = state.positions, state.rotations, state.goals
        self._shown = self._x
        self._trials = state.trials
        self._creases = None
        if state.creases is not None:
            self._made_creases().restore(state.creases)

    def solve(
        self, targets: ArrayLike, iterations: int = 1, *, out: Floats | None = None
    ) -> Floats:
        """Return vertices (N, 3) whose handles are at `targets` (H, 3); hard handles exactly.

        The solver starts from the last answer, moved along with the handles, and takes `iterations`
        local and global steps; zero returns the start itself. The answer is written to `out` if
        given, else to a new array.

        Raises:
            ValueError: for targets of a wrong shape, not finite, or absurdly far away.
        """
        goals = checked_targets(targets, len(self._handles.places), self._box)
        check_steps(iterations)
        with threads_for(len(self._x)):
            self._move_along(self._box.inside(goals))
            answer = self._stepped(iterations, out)
        hard = self._handles.hard
        answer[self._layout.order[self._handles.places[hard]]] = goals[hard]
        return answer

    def relax(
        self, targets: ArrayLike, iterations: int = 1, *, out: Floats | None = None
    ) -> Floats:
        """Return vertices (N, 3) near `targets` (N, 3) that have less energy than these.

        Every vertex must be a soft handle. The solver starts at the targets themselves, so no
        earlier answer matters. `iterations` and `out` as of `solve`.

        Raises:
            ValueError: as of `solve`, and where some vertex is no soft handle.
        """
        goals = checked_targets(targets, len(self._x), self._box)
        check_steps(iterations)
        if not self._handles.are_soft_everywhere(len(self._x)):
            raise ValueError("expected every vertex to be a soft handle: hold all of them first")
        with threads_for(len(self._x)):
            self._x[self._handles.places] = self._goals = self._box.inside(goals)
            self._trials = self._trials.after_solve()
            if self._priors.is_on:  # they depend on each other's rotations
                self._fit(self._x, NO_PRIORS)
            return self._stepped(iterations, out)

    def _stepped(self, iterations: int, out: Floats | None) -> Floats:
        """Take iterations from x, and return the surface to show (N, 3), outside the box."""
        answer = np.empty_like(self._x) if out is None else out
        self._step(iterations)
        self._shown = self._pose_step() if iterations else self._x
        place_outside(self._shown, self._layout.order, self._box.centre, self._box.size, answer)
        return answer

    def settle(self, iterations: int = 1) -> None:
        """Take `iterations` more steps towards the targets of the last solve.

        Call it between two frames, after the answer is shown: the next solve then starts nearer to
        its answer. A trial of the rest pose that is due is done here, not in the next solve.
        """
        with threads_for(len(self._x)):
            share = self._trials.share_between_frames()
            if share is not None:
                self._try_from_rest(self._goals, share)
            self._step(iterations)

    @property
    def energy(self) -> float:
        """The energy of the last answer with its best rotations, in the vertices' unit squared."""
        rotations = self._R.copy()
        energy = self._energy_of(self._x)
        self._R[:] = rotations
        return energy * self._box.size**2

    def flatten_folds(self, answer: Floats) -> int:
        """Flatten the folded triangles of the last solve's answer (N, 3), in place.

        The solver's own state does not change: see `solvers.deform.creases`.

        Returns:
            The number of folded triangles.
        """
        box, order = self._box, self._layout.order
        self._from_rest[:] = self._shown
        with threads_for(len(order)):
            folded = self._made_creases().flatten_folds(self._from_rest, self._R)
        if folded:
            place_outside(self._from_rest, order, box.centre, box.size, answer)
        return folded

    def _made_creases(self) -> Creases:
        if self._creases is None:
            self._creases = Creases(self._rest, self._layout.faces, self._mesh.cells)
        return self._creases

    def rotations(self) -> Floats:
        """Return the rotation of each vertex's cell after the last iteration, (N, 3, 3)."""
        return self._R[self._layout.place].reshape(-1, 3, 3)

    def _step(self, iterations: int) -> None:
        for _ in range(iterations):
            self._local_step(self._x)
            self._global_step()

    def _local_step(self, x: Floats) -> None:
        priors = self._priors.find(self._R)
        self._fit(x, priors)
        if len(priors):
            self._priors.turn_regions(priors, self._R)

    def _fit(self, x: Floats, priors: Floats) -> None:
        """Fit the cells to x, near priors (N, 9), which become the covariances, or none (0, 9)."""
        cells = self._mesh.cells
        if len(priors):
            fit_cells_near(x, cells, priors, self._R, self._laplace_x, self._room)
        else:
            fit_cells(x, cells, self._R, self._laplace_x, self._room)

    def _global_step(self) -> None:
        constraints, places = self._system.constraints, self._handles.places
        residual(self._R, self._laplace_x, self._mesh.cells, constraints.fixed, self._residual)
        pull_soft(places, constraints.stiffness, self._goals, self._x, self._residual)
        self._system.add_solution(self._residual, self._x)

    def _pose_step(self) -> Floats:
        """The surface to show (N, 3), once a frame."""
        return self._x

    def _move_along(self, goals: Floats) -> None:
        """Move x to the start of this frame's iterations, with hard handles at goals (H, 3)."""
        influence = self._influence
        influence.advance()
        step = influence.motions(self._goals, goals)
        angle, path = farthest_motion(step, self._goals, influence.known)
        follow(self._x, influence.influences, step, self._x)
        if self._priors.is_on:
            turn_along(self._R, influence.influences, step)
        self._goals = goals
        self._put_held(goals, self._x)
        self._trials = self._trials.after_step(angle, path)
        share = self._trials.share_after_step(angle, path)
        if share is not None:
            self._try_from_rest(goals, share)
        self._trials = self._trials.after_solve()

    def _try_from_rest(self, goals: Floats, share: float) -> None:
        """Replace x by the rest pose, moved along, if that has less than a share of x's energy."""
        self._trials = self._trials.after_trial()
        if self._trials.is_fresh:  # x is that already
            return
        influence, ties = self._influence, self._priors.is_on
        whole = influence.motions(self._rest[self._handles.places], goals)
        follow(self._rest, influence.influences, whole, self._from_rest)
        self._put_held(goals, self._from_rest)
        if ties:  # rotations that depend on each other move along with their positions
            self._R, self._R_aside = self._R_aside, self._R
            self._R[:] = _NO_TURN
            turn_along(self._R, influence.influences, whole)
        fresh = self._energy_of(self._from_rest)
        if ties:
            self._R, self._R_aside = self._R_aside, self._R
        if fresh < share * self._energy_of(self._x):
            self._x[:] = self._from_rest
            if ties:
                self._R, self._R_aside = self._R_aside, self._R

    def _put_held(self, goals: Floats, x: Floats) -> None:
        """Move hard handles in x to their goals (H, 3), and carried parts with their groups."""
        handles = self._handles
        x[handles.places[handles.hard]] = goals[handles.hard]
        self._carried.move(self._rest, handles, goals, x)

    def _energy_of(self, x: Floats) -> float:
        """The energy of x with the rotations of its next local step."""
        self._local_step(x)
        return self._sum_terms(x) + self._priors.energy(self._R)

    def _sum_terms(self, x: Floats) -> float:
        energy_terms(x, self._R, self._rest, self._mesh.terms, self._energy_terms)
        return float(self._energy_terms.sum())

    def _constraints(self) -> Constraints:
        return self._carried.constraints(self._handles, len(self._rest), self._unit)
