"""A performer's skeleton and one captured frame of it: the two types that every room speaks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import InputError


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
    """Joints of one kind of performer, joined as a tree.

    Attributes:
        names: J joint names, unique.
        parents: (J,) int; index of each joint's parent, -1 for the one root. Any order.
        rest_positions: (J, 3) [m], right-handed, +Y up, facing +Z; where the joints stand at rest.

    Raises:
        InputError: a parent index out of range, more than one root, a cycle, a repeated name, or a
            rest position that is not finite.
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
        if np.count_nonzero(self.parents == -1) != 1:
            raise InputError(
                f"a skeleton needs exactly one root, got {np.count_nonzero(self.parents == -1)}"
            )
        if self.parents.min() < -1 or self.parents.max() >= count or len(self.order) != count:
            raise InputError("the skeleton's parents do not form a tree")

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Joint indices with every parent before its children."""
        children: list[list[int]] = [[] for _ in self.names]
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                children[parent].append(joint)
        order = [int(np.flatnonzero(self.parents == -1)[0])]
        for joint in order:
            order.extend(children[joint])
        return tuple(order)

    @property
    def root(self) -> int:
        """Index of the root joint."""
        return self.order[0]

    def index(self, name: str) -> int:
        """Index of the joint called `name`.

        Raises:
            InputError: no joint has that name; the message lists those there are.
        """
        if name not in self.names:
            raise InputError(f"no joint is called {name!r}; there are: {', '.join(self.names)}")
        return self.names.index(name)


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonFrame:
    """One capture of one performer. Frozen because it crosses threads.

    Attributes:
        time: the performer's time [s]: device clock mapped to the host's monotonic clock.
        positions: (J, 3) [m], world, right-handed, +Y up; NaN where a joint was not seen.
        rotations: (J, 4) unit quaternions (x, y, z, w), joint to world, or None when the source
            has none; NaN where unknown.
        confidence: (J,) in [0, 1]; 0 exactly where the position is NaN.
        performer: who it is, a small number that stays with a person.
        arrival: host monotonic time [s] when it came in; NaN when the recording does not say.
    """

    time: float
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    confidence: NDArray[np.float64]
    performer: int = 0
    arrival: float = float("nan")

    def __post_init__(self) -> None:
        count = len(self.positions)
        for name, shape in (("positions", (count, 3)), ("confidence", (count,))):
            object.__setattr__(self, name, _frozen(getattr(self, name), np.float64, shape, name))
        if self.rotations is not None:
            rotations = _frozen(self.rotations, np.float64, (count, 4), "rotations")
            object.__setattr__(self, "rotations", rotations)
