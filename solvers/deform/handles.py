"""The handles of a deformation: which vertices are held, in which groups, and how firmly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from solvers.deform.arap_layout import Layout, check_range, checked_integers
from solvers.kernels.compiled import kernel
from solvers.kernels.quaternion import matrix, normalized
from solvers.linear.laplacian import Floats, Ints

HARD = np.inf  # the weight of a handle that is met exactly

# The least weight of a soft handle: a surface without any hold has no unique solution.
LEAST_WEIGHT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Handles:
    """H handles of a surface of N vertices, in its working order.

    Attributes:
        places: (H,) the place of each handle in the solver's order.
        group_of: (H,) the group of each, 0 to count - 1; a group moves rigidly.
        count: the number of groups.
        weights: (H,) how firmly each is held, as shares of the mean weight of a vertex in the
            surface's Laplacian; `HARD` meets the target exactly.
    """

    places: Ints
    group_of: Ints
    count: int
    weights: Floats

    @property
    def hard(self) -> NDArray[np.bool_]:
        """(H,) bool: the handles whose targets are met exactly."""
        return np.isinf(self.weights)

    def are_soft_everywhere(self, count: int) -> bool:
        """Whether each of `count` vertices is a handle, and none is met exactly."""
        return len(self.places) == count and not self.hard.any()

    def goals_after(self, before: Handles, goals: Floats, x: Floats) -> Floats:
        """Return where these handles start: at their previous goals, or at their places in x.

        Args:
            before: the handles that these replace.
            goals: theirs (G, 3).
            x: the vertices (N, 3).
        """
        start: Floats = x[self.places]
        _, old, kept = np.intersect1d(before.places, self.places, return_indices=True)
        start[kept] = goals[old]
        return start

    def reweighted(self, weights: ArrayLike) -> Handles:
        """The same handles with other weights (H,)."""
        return Handles(self.places, self.group_of, self.count, _checked_weights(weights, self))


def checked_handles(
    handles: ArrayLike, groups: ArrayLike | None, weights: ArrayLike | None, layout: Layout
) -> Handles:
    """Return handles given by vertex index (H,), or raise a ValueError that states the fault."""
    chosen = checked_integers(handles, "handles")
    if chosen.ndim != 1 or not len(chosen):
        raise ValueError(f"expected handles of shape (H,), H > 0, got {chosen.shape}")
    check_range(chosen, len(layout.order), "handles")
    unique, times = np.unique(chosen, return_counts=True)
    if len(unique) < len(chosen):
        raise ValueError(f"vertex {unique[times > 1][0]} is a handle more than once")
    group_of, count = np.zeros(len(chosen), dtype=np.int64), 1
    if groups is not None:
        labels = checked_integers(groups, "groups")
        if labels.shape != chosen.shape:
            raise ValueError(f"expected groups of shape {chosen.shape}, got {labels.shape}")
        names, group_of = np.unique(labels, return_inverse=True)
        group_of, count = group_of.astype(np.int64), len(names)
    hard = Handles(layout.place[chosen], group_of, count, np.full(len(chosen), HARD))
    return hard if weights is None else hard.reweighted(weights)


def _checked_weights(weights: ArrayLike, handles: Handles) -> Floats:
    values = np.array(weights, dtype=np.float64)
    if values.shape != handles.places.shape:
        raise ValueError(f"expected weights of shape {handles.places.shape}, got {values.shape}")
    if not (values >= 0.0).all():
        bad = int(np.flatnonzero(~(values >= 0.0))[0])
        raise ValueError(
            f"the weight of handle {bad} is {values[bad]}: use 0 or more, inf for hard"
        )
    return np.maximum(values, LEAST_WEIGHT)


def unheld(handles: Handles, layout: Layout) -> Ints:
    """Return the places of the vertices without a face or in a component without a handle."""
    held = np.zeros(int(layout.parts.max()) + 1, dtype=bool)
    held[layout.parts[handles.places]] = True
    free = ~held[layout.parts]
    free[handles.places] = False
    return np.flatnonzero(free)


def nearest_groups(rest: Floats, carried: Ints, handles: Handles, parts: Ints) -> Ints:
    """Return for each carried vertex (C,) the group nearest to its component at rest."""
    if not len(carried):
        return np.zeros(0, dtype=np.int64)
    distance, handle = KDTree(rest[handles.places]).query(rest[carried])
    part_of = parts[carried]
    nearest_first = np.lexsort((carried, distance))
    _, where = np.unique(part_of[nearest_first], return_index=True)
    nearest = np.zeros(int(parts.max()) + 1, dtype=np.int64)
    nearest[part_of[nearest_first][where]] = handles.group_of[handle[nearest_first][where]]
    return nearest[part_of]


def stretched_turns(
    turns: Floats, axes: Floats, lengths: Floats, thinning: float, whole: Floats
) -> Floats:
    """Return the maps (G, 3, 3) that stretch groups along an axis, turn them, and apply `whole`.

    Across its axis a group is scaled by its length to the power of -`thinning`.

    Args:
        turns: (G, 4) rotations, quaternions (x, y, z, w) of any length.
        axes: (G, 3) unit vectors at rest; zero for a group that is scaled in all directions.
        lengths: (G,) the length of each along its axis over its length at rest, positive.
        thinning: 0.5 keeps the volume.
        whole: (3, 3) a map that is applied to all groups afterwards.
    """
    maps = np.empty((len(turns), 3, 3))
    _turn_and_stretch(turns, axes, lengths, thinning, whole, maps)
    return maps


@kernel
def _turn_and_stretch(
    turns: Floats, axes: Floats, lengths: Floats, thinning: float, whole: Floats, out: Floats
) -> None:
    stretched = np.empty((3, 3))
    for g in range(len(turns)):
        R = matrix(normalized((turns[g, 0], turns[g, 1], turns[g, 2], turns[g, 3])))
        a = (axes[g, 0], axes[g, 1], axes[g, 2])
        thin = lengths[g] ** -thinning
        # R (thin I + (length - thin) a a^T), row by row
        for i in range(3):
            r = R[i]
            along = (lengths[g] - thin) * (r[0] * a[0] + r[1] * a[1] + r[2] * a[2])
            for j in range(3):
                stretched[i, j] = thin * r[j] + along * a[j]
        for i in range(3):
            for j in range(3):
                out[g, i, j] = (
                    whole[i, 0] * stretched[0, j]
                    + whole[i, 1] * stretched[1, j]
                    + whole[i, 2] * stretched[2, j]
                )


def group_targets(offsets: Floats, group_of: Ints, turns: Floats, positions: Floats) -> Floats:
    """Return targets (H, 3) of handles from a position and a rotation of each group.

    Args:
        offsets: (H, 3) of each handle from its group's origin, at rest.
        group_of: (H,) the group of each, 0 to G - 1.
        turns: (G, 3, 3) rotations, or any other linear maps, of the groups.
        positions: (G, 3) of the groups' origins.
    """
    targets = np.empty_like(offsets)
    _move_groups(offsets, group_of, turns, positions, targets)
    return targets


@kernel
def _move_groups(
    offsets: Floats, group_of: Ints, turns: Floats, positions: Floats, out: Floats
) -> None:
    for h in range(len(offsets)):
        g = group_of[h]
        for i in range(3):
            out[h, i] = positions[g, i]
            for j in range(3):
                out[h, i] += turns[g, i, j] * offsets[h, j]
