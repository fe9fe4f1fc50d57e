"""A performer's skeleton and one captured frame of it: the two types that all rooms share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import InputError
from solvers.skeleton.tree import Tree, parents_first

FARTHEST = 1e6  # [m] from the origin of a place that is believed
MOST_SECONDS = 1e11  # [s] of a time that is believed: 3000 years; beyond, no milliseconds are left


def _frozen(
    values: ArrayLike, dtype: type, shape: tuple[int, ...], name: str
) -> NDArray[np.generic]:
    array: NDArray[np.generic] = np.array(values, dtype=dtype)
    if array.shape != shape:
        raise ValueError(f"Expected `{name}` to have shape {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The joints of a performer, connected as a tree.

    Attributes:
        names: J joint names, unique.
        parents: (J,) int; index of each joint's parent, -1 for the one root. Any order.
        rest_positions: (J, 3) [m], right-handed, +Y up, facing +Z; the joints at rest.

    Raises:
        InputError: a parent index is out of range, there are several roots, a cycle or a repeated
            name, or a rest position is not finite.
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    rest_positions: NDArray[np.float64]

    def __post_init__(self) -> None:
        count = len(self.names)
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "parents", _frozen(self.parents, np.int64, (count,), "parents"))
        rest = _frozen(self.rest_positions, np.float64, (count, 3), "rest_positions")
        object.__setattr__(self, "rest_positions", rest)
        if count == 0:
            raise InputError("a skeleton needs at least one joint")
        if len(set(self.names)) != count:
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise InputError(f"joint name {twice!r} occurs more than once in the skeleton")
        if not np.isfinite(rest).all():
            raise InputError("a rest position of the skeleton is not a finite number")
        try:
            parents_first(self.parents)
        except ValueError as error:
            raise InputError(f"a skeleton needs {error}") from error

    @cached_property
    def tree(self) -> Tree:
        """The joints as nodes at their rest positions."""
        return Tree(self.parents, self.rest_positions)

    @property
    def order(self) -> tuple[int, ...]:
        """Joint indices with every parent before its children."""
        return self.tree.order

    @property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """The children of each joint, in ascending order."""
        return self.tree.children

    @property
    def root(self) -> int:
        """Index of the root joint."""
        return self.tree.root

    def index(self, name: str) -> int:
        """Return the index of the joint called `name`.

        Raises:
            InputError: no joint has that name; the message lists the known ones.
        """
        if name not in self.names:
            raise InputError(f"no joint is called {name!r}; known joints: {', '.join(self.names)}")
        return self.names.index(name)


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonFrame:
    """One capture of one performer. Frozen because it crosses threads.

    Attributes:
        time: capture time [s]: the device's clock mapped to the host's monotonic clock.
        positions: (J, 3) [m], world, right-handed, +Y up; NaN where a joint was not seen.
        rotations: (J, 4) unit quaternions (x, y, z, w), joint to world, or None when the source
            has none; NaN where unknown.
        confidence: (J,) in [0, 1]; 0 exactly where the position is NaN.
        performer: number of the performer; a person keeps it from frame to frame.
        arrival: host monotonic time [s] at which the frame came in; NaN if a recording lacks it.
        blends: weights in [0, 1] of the face's blend shapes by name, at most 512 of them, or None
            when the source has none; a source that sends them less often repeats the last ones.
    """

    time: float
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    confidence: NDArray[np.float64]
    performer: int = 0
    arrival: float = float("nan")
    blends: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        count = len(self.positions)
        for name, shape in (("positions", (count, 3)), ("confidence", (count,))):
            object.__setattr__(self, name, _frozen(getattr(self, name), np.float64, shape, name))
        if self.rotations is not None:
            rotations = _frozen(self.rotations, np.float64, (count, 4), "rotations")
            object.__setattr__(self, "rotations", rotations)
