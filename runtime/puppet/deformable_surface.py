"""The surface of a character as a solver deforms it: handles, elasticity and iterations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from runtime.characters.proxy import Proxy
from runtime.driving.targets import SKIN_FIRMNESS, HandleGroups, HandleTargets, SkinnedTargets
from solvers.deform.arap_cells import SPOKES
from solvers.deform.handles import HARD
from solvers.deform.solver_state import DeformationState
from solvers.deform.stiff_segments import StiffSegments
from solvers.squash_stretch import SquashStretchSolver
from solvers.surface.edges import Edges

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Elasticity:
    """The material of a surface. It may be changed while a show runs.

    Attributes:
        cartoon: 0 keeps every part rigid, 1 lets it squash and stretch.
        volume_gain: share of the volume lost by squash and stretch that is kept; more than 1
            exaggerates.
        stiffness: 0 lets limbs bend everywhere; towards 1 they bend at their joints only.
    """

    cartoon: float = 0.0
    volume_gain: float = 1.0
    stiffness: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceState:
    """The state of a `DeformableSurface` between two frames.

    Attributes:
        solver: of the solver.
        handles: the handles that are held.
        weights: (H,) how firmly each is held.
    """

    solver: DeformationState
    handles: HandleGroups
    weights: Array


class DeformableSurface:
    """Deforms the surface of a character so that its handles meet their targets.

    A dense surface is not deformed itself: the solver deforms a coarse proxy, and the dense
    surface follows it.

    Args:
        proxy: the surface that is deformed, and how the character's vertices follow it.
        handles: the handles that are held first.
        stiff_segments: finds the parts that `Elasticity.stiffness` keeps from bending; called when
            the stiffness is first above 0.
        energy: what is kept as rigid as possible: see `ArapSolver`.

    Attributes:
        rest: (C, 3) [m] the deformed surface at rest.
        kept: (C,) the character's vertex at each of its vertices.
        edges: its edges.
        notes: messages for the user, one short line each.
    """

    def __init__(
        self,
        proxy: Proxy,
        handles: HandleGroups,
        stiff_segments: Callable[[], StiffSegments],
        *,
        energy: str = SPOKES,
    ) -> None:
        self.rest, self.kept, self.notes = proxy.vertices, proxy.kept, proxy.notes
        self.edges = Edges.of(proxy.vertices, proxy.faces)
        self._proxy = proxy
        self._solver = SquashStretchSolver(
            proxy.vertices,
            proxy.faces,
            handles.vertices,
            energy=energy,
            groups=handles.group_of,
            cartoon=0.0,
        )
        self._handles = handles
        self._weights = np.full(len(handles.vertices), HARD)  # of each handle
        self._asked: Array | None = None  # the weights of the last targets
        every = np.arange(len(self.rest))
        self._every_vertex = HandleGroups(every, np.zeros_like(every))
        self._firmness = np.array([SKIN_FIRMNESS])  # of the last targets of a skin
        self._stiff_segments = stiff_segments
        self._is_segmented = False
        self._answer = np.empty_like(self.rest)
        self.elasticity = Elasticity()

    @property
    def elasticity(self) -> Elasticity:
        """The material of the surface."""
        return self._elasticity

    @elasticity.setter
    def elasticity(self, elasticity: Elasticity) -> None:
        self._solver.cartoon = elasticity.cartoon
        self._solver.volume_gain = elasticity.volume_gain
        if elasticity.stiffness > 0.0 and not self._is_segmented:
            segments = self._stiff_segments()
            self._solver.stiffen(segments.region_of, segments.rigidity)
            self._is_segmented = True
        self._solver.stiffness = elasticity.stiffness
        self._elasticity = elasticity

    def reset(self) -> None:
        """Forget the last answer: the next one starts from the rest pose."""
        self._solver.reset()

    def snapshot(self) -> SurfaceState:
        """Return what the next answer depends on, besides targets and elasticity."""
        return SurfaceState(self._solver.snapshot(), self._handles, self._weights)

    def restore(self, state: SurfaceState) -> None:
        """Go back to a snapshot of the same surface; the elasticity stays as it is."""
        self._solver.restore(state.solver)
        self._handles, self._weights, self._asked = state.handles, state.weights, None

    def deform(self, targets: HandleTargets | SkinnedTargets, iterations: int) -> Array:
        """Return the deformed surface (C, 3) [m]; the next call overwrites it.

        With targets of handles it goes on from the last answer, with those of a skin from these.
        """
        if isinstance(targets, SkinnedTargets):
            self.hold(self._held_by_skin(targets))
            return self._solver.relax(targets.positions, iterations, out=self._answer)
        self.hold(targets)
        self._solver.solve(targets.positions, iterations, out=self._answer)
        self._solver.flatten_folds(self._answer)
        return self._answer

    def hold(self, targets: HandleTargets) -> None:
        """Hold the handles of these targets, as firmly as their weights say."""
        handles = targets.handles
        if handles is self._handles and targets.weights is self._asked:
            return
        weights = targets.weights[handles.group_of]
        if handles != self._handles:
            self._solver.hold(handles.vertices, groups=handles.group_of, weights=weights)
        elif not np.array_equal(weights, self._weights):
            self._solver.weigh(weights)
        self._handles, self._weights, self._asked = handles, weights, targets.weights

    def _held_by_skin(self, targets: SkinnedTargets) -> HandleTargets:
        """The targets of a skin, as those of one soft handle at each vertex."""
        if self._firmness[0] != targets.firmness:
            self._firmness = np.array([targets.firmness])
        return HandleTargets(self._every_vertex, targets.positions, self._firmness)

    @property
    def stretch(self) -> Array:
        """The relative change of length of each edge (E,) in the last answer."""
        return self.edges.stretch(self._answer)

    def settle(self, iterations: int) -> None:
        """Bring the solver's surface nearer to the last targets; `deform`'s answer stays."""
        self._solver.settle(iterations)

    def cover(self, deformed: Array) -> Array:
        """Return the character's vertices (N, 3) [m] that follow the deformed surface (C, 3).

        The next call overwrites them, or they are the deformed surface itself.
        """
        return self._proxy.follow(deformed)
