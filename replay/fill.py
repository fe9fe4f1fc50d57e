"""The fill stage: joints that were not seen are held, then eased to rest; nothing after sees a NaN.

A joint is held relative to its parent, so that a hidden hand goes along with its arm. Where the
root itself is hidden, it is placed from the seen joint nearest to it, so that a hidden pelvis goes
along with the shoulders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame
from solvers.kernels.compiled import exact_kernel

KEEP_SECONDS = 0.5
EASE_SECONDS = 1.0
MOST_PERFORMERS = 64  # that are remembered; a sensor may number people anew for ever
FARTHEST = 100.0  # [m] from the origin; what claims to lie further was not seen

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]
Records = NDArray[np.void]
Record = Any  # one of them; compiled code writes through it

# Of each joint: its parent, itself for the root; the joints one after another, parents first.
# Where it stands at rest, from its parent or, the root, from the origin; where it stood from its
# parent when it was last seen, and when; where it is taken to stand if it is not seen now. The mean
# length of its bone, and over how many frames.
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
    """A frame in which every joint has a place.

    Attributes:
        positions: (J, 3) [m], all finite.
        filled: (J,) bool, True where the joint was not seen and its place is a guess.
    """

    positions: Array
    filled: Bools


@dataclass(frozen=True, slots=True, eq=False)
class _Memory:
    """What is known of one performer: of each joint, and where the root (3,) [m] was, NaN before
    the first frame."""

    joints: Records
    root: Array


@dataclass(frozen=True, slots=True, eq=False)
class FillerState:
    """The memories of all performers, the first seen first: number, (J,) of `_JOINT`, root (3,)."""

    memories: tuple[tuple[int, Records, Array], ...]


class Filler:
    """Fills frames of one skeleton; remembers each performer apart.

    Args:
        skeleton: of all frames; its rest pose is what an unseen joint returns to, scaled to the
            performer's size.
        hold: how long [s] an unseen joint keeps its place relative to its parent.
        ease: how long [s] it then takes to come to rest: the bone turns by slerp, with
            3w^2 - 2w^3 of the time passed.
    """

    def __init__(
        self, skeleton: Skeleton, *, hold: float = KEEP_SECONDS, ease: float = EASE_SECONDS
    ) -> None:
        self.skeleton = skeleton
        self.hold = hold
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
        """The frame with every joint placed; see `place`."""
        return self.place(frame.positions, frame.time, frame.performer)

    def place(self, positions: Array, time: float, performer: int) -> FilledFrame:
        """Place every joint.

        Args:
            positions: (J, 3) [m]; NaN where not seen.
            time: [s].
            performer: whose they are.

        Raises:
            ValueError: it has not the skeleton's number of joints.
        """
        expected = (len(self._unseen), 3)
        if positions.shape != expected:
            raise ValueError(f"Expected positions {expected}, got {positions.shape}")
        memory = self._memory(performer)
        placed, filled = positions.copy(), np.empty(len(positions), dtype=np.bool_)
        _fill(memory.joints, memory.root, placed, filled, (time, self.hold, self.ease))
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
    time, hold, ease = times
    if _look(joints, positions, filled, time):
        scale = _scale(joints)
        _guess(joints, scale, time, hold, ease)
        if np.isnan(root[0]):
            root[:] = joints[joints[0].order].rest * scale
        _place(joints, positions, filled, root)
    _remember(joints, positions, filled, time)
    root[:] = positions[joints[0].order]


@exact_kernel
def was_seen(place: Array) -> bool:
    """Whether a place (3,) [m] has no NaN and lies not beyond `FARTHEST`."""
    x, y, z = np.abs(place)
    return bool(x <= FARTHEST and y <= FARTHEST and z <= FARTHEST)


@exact_kernel
def _look(joints: Records, positions: Array, filled: Bools, time: float) -> bool:
    """Tell which joints must be filled, and whether any; measure the bones that are seen."""
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
    """How much larger the performer is than the rest pose."""
    ratios = np.empty(len(joints))
    known = 0
    for joint in joints:
        if joint.count > 0 and joint.length > 0.0:
            ratios[known] = joint.length / _length(joint.rest)
            known += 1
    return float(np.median(ratios[:known])) if known > 0 else 1.0


@exact_kernel
def _guess(joints: Records, scale: float, time: float, hold: float, ease: float) -> None:
    """Tell where each joint stands from its parent if it is not seen now."""
    for joint in joints:
        age = time - joint.seen_at - hold
        if age <= 0.0:
            joint.guess[:] = joint.offset
        elif age >= ease:
            joint.guess[:] = joint.rest * scale
        else:
            w = age / ease
            turn(joint.offset, joint.rest * scale, w * w * (3.0 - 2.0 * w), joint.guess)


@exact_kernel
def _place(joints: Records, positions: Array, filled: Bools, root: Array) -> None:
    """Put joints that must be filled where they stand from their parents."""
    placed, order = ~filled, joints["order"]
    if filled[order[0]]:
        positions[order[0]] = root
        placed[order[0]] = True
        joint = _nearest_seen(order, filled)
        while joint != order[0]:
            parent = joints[joint].parent
            positions[parent] = positions[joint] - joints[joint].guess
            placed[parent] = True
            joint = parent
    for joint in order:
        if not placed[joint]:
            positions[joint] = positions[joints[joint].parent] + joints[joint].guess


@exact_kernel
def _nearest_seen(order: Indices, filled: Bools) -> int:
    for joint in order:
        if not filled[joint]:
            return int(joint)
    return int(order[0])


@exact_kernel
def _remember(joints: Records, positions: Array, filled: Bools, time: float) -> None:
    # A joint whose parent was guessed keeps its old offset only while the guess came from it;
    # elsewhere the offset from the guess is what keeps the joint still when it disappears.
    for index, joint in enumerate(joints):
        if not filled[index]:
            joint.offset[:] = positions[index] - positions[joint.parent]
            joint.seen_at = time


@exact_kernel
def turn(start: Array, end: Array, weight: float, out: Array) -> None:
    """Put a vector on its way from `start` to `end` (3,), by `weight` in [0, 1], into `out` (3,).

    The direction goes by slerp, the length linearly. Opposite directions turn by way of an axis at
    right angles to them.
    """
    before, after = _length(start), _length(end)
    if min(before, after) <= 1e-9:
        out[:] = (1.0 - weight) * start + weight * end
        return
    a, b = start / before, end / after
    cosine = min(max((a * b).sum(), -1.0), 1.0)
    side = b - cosine * a
    sine = _length(side)
    if sine < 1e-6:
        least = np.zeros(3)
        least[np.argmin(np.abs(a))] = 1.0
        side = np.cross(a, least)
    side /= max(_length(side), 1e-12)
    angle = weight * np.arctan2(sine, cosine)
    length = (1.0 - weight) * before + weight * after
    out[:] = length * (np.cos(angle) * a + np.sin(angle) * side)


@exact_kernel
def _length(vector: Array) -> float:
    return float(np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2))
