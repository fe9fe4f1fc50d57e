"""Fill joints that were not seen: they keep their offset, then ease to rest; no NaN remains.

A joint keeps its offset from its parent, so a hidden hand follows its arm. A hidden root is placed
from the nearest seen joint, so a hidden pelvis follows the shoulders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame
from solvers.kernels.compiled import exact_kernel
from solvers.kernels.short_loops import median, put

KEEP_SECONDS = 0.5
EASE_SECONDS = 1.0
MOST_PERFORMERS = 64  # performers that are remembered; a sensor may assign ever new numbers
FARTHEST = 100.0  # [m] from the origin; a position beyond counts as not seen

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]
Records = NDArray[np.void]
Record = Any  # one of them; compiled code writes through it

# Of each joint: its parent (itself for the root); the joints in order, parents first; its rest
# position, relative to its parent or, for the root, to the origin; its last seen offset from the
# parent, and the time; its assumed offset if it is not seen now; the mean length of its bone, and
# the number of frames of that mean.
_JOINT = np.dtype(
    [
        ("parent", np.int64),
        ("order", np.int64),
        ("rest", np.float64, 3),
        ("offset", np.float64, 3),
        ("seen_at", np.float64),
        ("guess", np.float64, 3),
        ("length", np.float64),
        ("count", np.int64),
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class FilledFrame:
    """A frame in which every joint has a position.

    Attributes:
        positions: (J, 3) [m], all finite.
        filled: (J,) bool, True where the joint was not seen and its position is a guess.
    """

    positions: Array
    filled: Bools


@dataclass(frozen=True, slots=True, eq=False)
class _Memory:
    """State of one performer: the joints, and the root's last position (3,) [m], NaN before the
    first frame."""

    joints: Records
    root: Array


@dataclass(frozen=True, slots=True, eq=False)
class FillerState:
    """The memories of all performers, the first seen first: number, (J,) of `_JOINT`, root (3,)."""

    memories: tuple[tuple[int, Records, Array], ...]


class Filler:
    """Fills frames of one skeleton, with separate state for each performer.

    Args:
        skeleton: of all frames; an unseen joint returns to its rest pose, scaled to the performer.
        keep: time [s] for which an unseen joint keeps its offset from its parent.
        ease: time [s] of the following transition to rest: the bone turns by slerp, with
            3w^2 - 2w^3 of the elapsed share w.
    """

    def __init__(
        self, skeleton: Skeleton, *, keep: float = KEEP_SECONDS, ease: float = EASE_SECONDS
    ) -> None:
        self.skeleton = skeleton
        self.keep = keep
        self.ease = ease
        rest, root = skeleton.rest_positions, skeleton.root
        parents = np.where(skeleton.parents < 0, root, skeleton.parents)
        self._unseen = np.zeros(len(rest), _JOINT)
        self._unseen["parent"], self._unseen["order"] = parents, skeleton.order
        self._unseen["rest"] = self._unseen["offset"] = rest - rest[parents]
        self._unseen["rest"][root] = rest[root]
        self._unseen["seen_at"] = -np.inf
        self._memories: dict[int, _Memory] = {}

    def snapshot(self) -> FillerState:
        """Return a copy of all memories."""
        return FillerState(
            tuple(
                (performer, memory.joints.copy(), memory.root.copy())
                for performer, memory in self._memories.items()
            )
        )

    def restore(self, state: FillerState) -> None:
        """Go back to a snapshot of a filler of the same skeleton."""
        self._memories = {
            performer: _Memory(joints.copy(), root.copy())
            for performer, joints, root in state.memories
        }

    def fill(self, frame: SkeletonFrame) -> FilledFrame:
        """Return the frame with every joint placed; see `place`."""
        return self.place(frame.positions, frame.time, frame.performer)

    def place(self, positions: Array, time: float, performer: int) -> FilledFrame:
        """Place every joint.

        Args:
            positions: (J, 3) [m]; NaN where not seen.
            time: [s].
            performer: number of the performer.

        Raises:
            ValueError: the number of joints differs from the skeleton's.
        """
        expected = (len(self._unseen), 3)
        if positions.shape != expected:
            raise ValueError(f"Expected positions {expected}, got {positions.shape}")
        memory = self._memory(performer)
        placed, filled = positions.copy(), np.empty(len(positions), dtype=np.bool_)
        _fill(memory.joints, memory.root, placed, filled, (time, self.keep, self.ease))
        return FilledFrame(placed, filled)

    def _memory(self, performer: int) -> _Memory:
        memory = self._memories.get(performer)
        if memory is None:
            memory = _Memory(self._unseen.copy(), np.full(3, np.nan))
            self._memories[performer] = memory
            if len(self._memories) > MOST_PERFORMERS:
                del self._memories[next(iter(self._memories))]
        return memory


@exact_kernel
def _fill(
    joints: Records, root: Array, positions: Array, filled: Bools, times: tuple[float, float, float]
) -> None:
    time, keep, ease = times
    if _look(joints, positions, filled, time):
        scale = _scale(joints)
        _guess(joints, scale, time, keep, ease)
        if np.isnan(root[0]):
            put(root, joints[joints[0].order].rest * scale)
        _place(joints, positions, filled, root)
    _remember(joints, positions, filled, time)
    put(root, positions[joints[0].order])


@exact_kernel
def was_seen(place: Array) -> bool:
    """Whether a position (3,) [m] has no NaN and lies within `FARTHEST`."""
    x, y, z = np.abs(place)
    return bool(x <= FARTHEST and y <= FARTHEST and z <= FARTHEST)


@exact_kernel
def _look(joints: Records, positions: Array, filled: Bools, time: float) -> bool:
    """Mark the joints to fill; return whether there are any; measure the seen bones."""
    for index, joint in enumerate(joints):
        filled[index] = not was_seen(positions[index])
        joint.seen_at = min(joint.seen_at, time)  # a clock that went back
    for index, joint in enumerate(joints):
        if _is_bone(joint, index) and not filled[index] and not filled[joint.parent]:
            joint.count += 1
            length = _length(positions[index] - positions[joint.parent])
            joint.length += (length - joint.length) / joint.count
    return bool(filled.any())


@exact_kernel
def _is_bone(joint: Record, index: int) -> bool:
    return bool(joint.parent != index and _length(joint.rest) > 0.0)


@exact_kernel
def _scale(joints: Records) -> float:
    """Size of the performer relative to the rest pose."""
    ratios = np.empty(len(joints))
    known = 0
    for joint in joints:
        if joint.count > 0 and joint.length > 0.0:
            ratios[known] = joint.length / _length(joint.rest)
            known += 1
    return median(ratios[:known]) if known > 0 else 1.0


@exact_kernel
def _guess(joints: Records, scale: float, time: float, keep: float, ease: float) -> None:
    """Set the assumed offset of each joint from its parent, for use if it is not seen now."""
    for joint in joints:
        age = time - joint.seen_at - keep
        if age <= 0.0:
            put(joint.guess, joint.offset)
        elif age >= ease:
            put(joint.guess, joint.rest * scale)
        else:
            w = age / ease
            turn(joint.offset, joint.rest * scale, w * w * (3.0 - 2.0 * w), joint.guess)


@exact_kernel
def _place(joints: Records, positions: Array, filled: Bools, root: Array) -> None:
    """Place the joints to fill at their assumed offsets."""
    placed, order = ~filled, joints["order"]
    if filled[order[0]]:
        put(positions[order[0]], root)
        placed[order[0]] = True
        joint = _nearest_seen(order, filled)
        while joint != order[0]:
            parent = joints[joint].parent
            put(positions[parent], positions[joint] - joints[joint].guess)
            placed[parent] = True
            joint = parent
    for joint in order:
        if not placed[joint]:
            put(positions[joint], positions[joints[joint].parent] + joints[joint].guess)


@exact_kernel
def _nearest_seen(order: Indices, filled: Bools) -> int:
    for joint in order:
        if not filled[joint]:
            return int(joint)
    return int(order[0])


@exact_kernel
def _remember(joints: Records, positions: Array, filled: Bools, time: float) -> None:
    # If a joint's parent was guessed, its old offset is kept only if the guess used it; otherwise
    # the offset from the guess is what keeps the joint still when it disappears.
    for index, joint in enumerate(joints):
        if not filled[index]:
            put(joint.offset, positions[index] - positions[joint.parent])
            joint.seen_at = time


@exact_kernel
def turn(start: Array, end: Array, weight: float, out: Array) -> None:
    """Write to `out` (3,) the vector a share `weight` in [0, 1] of the way from `start` to `end`.

    The direction is interpolated by slerp, the length linearly. Opposite directions turn about an
    axis at right angles to them.
    """
    before, after = _length(start), _length(end)
    if min(before, after) <= 1e-9:
        put(out, (1.0 - weight) * start + weight * end)
        return
    a, b = start / before, end / after
    cosine = min(max((a * b).sum(), -1.0), 1.0)
    side = b - cosine * a
    sine = _length(side)
    if sine < 1e-6:
        least = np.zeros(3)
        least[np.argmin(np.abs(a))] = 1.0
        side[0] = a[1] * least[2] - a[2] * least[1]
        side[1] = a[2] * least[0] - a[0] * least[2]
        side[2] = a[0] * least[1] - a[1] * least[0]
    side /= max(_length(side), 1e-12)
    angle = weight * np.arctan2(sine, cosine)
    length = (1.0 - weight) * before + weight * after
    put(out, length * (np.cos(angle) * a + np.sin(angle) * side))


@exact_kernel
def _length(vector: Array) -> float:
    return float(np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2))
