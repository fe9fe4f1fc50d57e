"""Which groups of handles each vertex follows before the solver bends the surface.

Each vertex follows a smooth blend of the motions of the groups with the largest influence on it.
The influences are harmonic functions of the held surface. After a change of handles the solver uses
the known influences until new ones are complete. Each frame finds three groups, so no frame waits;
the number does not depend on the speed of the machine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.deform.handle_motion import KEPT, Influences, fit_motions
from solvers.deform.handles import Handles
from solvers.kernels.compiled import kernel
from solvers.linear.constrained_system import ConstrainedSystem
from solvers.linear.laplacian import Floats, Ints

ROUNDS = 1  # of three groups each, in a frame


@dataclass(frozen=True, slots=True, eq=False)
class HandleInfluenceState:
    """The influences at one moment, and the progress of the search for new ones.

    Attributes:
        influences, known: as of `HandleInfluence`.
        count: the groups that `influences` names.
        group_at: (N,) the group at each vertex in the numbering of `influences`, -1 for none.
        handles: the handles whose influences are being found.
        latest: those handles with their newest weights.
        changed: whether the weights changed during the search.
        next_group: the first group that is still to be found.
        new_group_at: (N,) the group of `handles` at each vertex, -1 for none.
        groups: (N, KEPT) the groups that were found so far.
        weights: (N, KEPT) their shares.
    """

    influences: Influences
    known: Ints
    count: int
    group_at: Ints
    handles: Handles
    latest: Handles
    changed: bool
    next_group: int
    new_group_at: Ints
    groups: NDArray[np.uint32]
    weights: Floats

    @property
    def is_complete(self) -> bool:
        """Whether all groups were found; nothing writes to `groups` and `weights` then."""
        return self.next_group >= self.handles.count


class HandleInfluence:
    """Finds the groups of handles that a surface's vertices follow.

    Args:
        system: the surface's Laplacian, held by the handles.
        handles: the handles and their groups.

    Attributes:
        influences: the groups that each vertex follows, in the numbering of the handles for which
            they were found.
        known: (H,) the group of each handle in that numbering, -1 for a handle that is newer.
    """

    influences: Influences
    known: Ints
    _next: int
    _handles: Handles

    def __init__(self, system: ConstrainedSystem, handles: Handles) -> None:
        self._system = system
        self._scratch = np.empty((len(system.constraints.fixed), 3))
        self._changed = False
        self._begin(handles)
        self._complete()

    def hold(self, handles: Handles) -> None:
        """Find the influences of other handles or groups from now on."""
        self._begin(handles)
        self.known = self._group_at[handles.places]
        if not (self.known >= 0).any():
            self._complete()

    def reweigh(self, handles: Handles) -> None:
        """Take new weights of the same handles; a search in progress is completed first."""
        self._changed = True
        if self._next >= self._handles.count:
            self._begin(handles)
        self._latest = handles

    def snapshot(self) -> HandleInfluenceState:
        """Return the influences and the state of the search; arrays in progress are copied."""
        state = HandleInfluenceState(
            self.influences,
            self.known,
            self._count,
            self._group_at,
            self._handles,
            self._latest,
            self._changed,
            self._next,
            self._new_group_at,
            self._groups,
            self._weights,
        )
        return state if state.is_complete else _with_copies(state)

    def restore(self, state: HandleInfluenceState) -> None:
        """Go back to a snapshot; the system must be held as it was then."""
        if not state.is_complete:
            state = _with_copies(state)
        self.influences, self.known = state.influences, state.known
        self._count, self._group_at = state.count, state.group_at
        self._handles, self._latest, self._changed = state.handles, state.latest, state.changed
        self._next, self._new_group_at = state.next_group, state.new_group_at
        self._groups, self._weights = state.groups, state.weights

    def advance(self) -> None:
        """Find the influences of the next groups, if any are missing."""
        for _ in range(ROUNDS):
            if self._next >= self._handles.count:
                return
            self._find_three()

    def motions(self, before: Floats, after: Floats) -> Floats:
        """The groups' motions (G, 8) that take the handles from `before` (H, 3) to `after`."""
        return fit_motions(before, after, self.known, self._count)

    def _begin(self, handles: Handles) -> None:
        self._handles = self._latest = handles
        self._changed = False
        self._next = 0
        self._new_group_at = np.full(len(self._scratch), -1, dtype=np.int64)
        self._new_group_at[handles.places] = handles.group_of
        self._groups = np.zeros((len(self._scratch), KEPT), dtype=np.uint32)
        self._weights = np.zeros((len(self._scratch), KEPT))

    def _complete(self) -> None:
        while self._next < self._handles.count:
            self._find_three()

    def _find_three(self) -> None:
        self._system.harmonic(self._new_group_at, self._next, self._scratch)
        most = min(self._handles.count - self._next, 3)
        _keep_largest(self._scratch, self._next, most, self._groups, self._weights)
        self._next += 3
        if self._next >= self._handles.count:
            _normalise(self._weights)
            self.influences = Influences(self._groups, self._weights)
            self._count = self._handles.count
            self._group_at = self._new_group_at
            self.known = self._group_at[self._handles.places]
            if self._changed:
                self._begin(self._latest)


def _with_copies(state: HandleInfluenceState) -> HandleInfluenceState:
    return replace(state, groups=state.groups.copy(), weights=state.weights.copy())


@kernel
def _keep_largest(
    shares: Floats, first: int, most: int, groups: NDArray[np.uint32], weights: Floats
) -> None:
    """Insert the shares of three more groups into each vertex's list, largest first."""
    for i in range(len(groups)):
        for k in range(most):
            w = shares[i, k]
            if w > weights[i, KEPT - 1]:
                slot = KEPT - 1
                while slot > 0 and w > weights[i, slot - 1]:
                    weights[i, slot], groups[i, slot] = weights[i, slot - 1], groups[i, slot - 1]
                    slot -= 1
                weights[i, slot], groups[i, slot] = w, first + k


@kernel
def _normalise(weights: Floats) -> None:
    """Scale each row to a sum of one; a row without any share follows its first group."""
    for i in range(len(weights)):
        total = 0.0
        for k in range(KEPT):
            total += weights[i, k]
        if total == 0.0:
            weights[i, 0] = total = 1.0
        for k in range(KEPT):
            weights[i, k] /= total
