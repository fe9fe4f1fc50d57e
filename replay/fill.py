"""The fill stage: joints that were not seen are held, then eased to rest; nothing after sees a NaN.

A joint is held relative to its parent, so that a hidden hand goes along with its arm. Where the
root itself is hidden, it is placed from the seen joint nearest to it, so that a hidden pelvis goes
along with the shoulders.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame

HOLD_SECONDS = 0.5
EASE_SECONDS = 1.0
MOST_PERFORMERS = 64  # that are remembered; a sensor may number people anew for ever
FARTHEST = 100.0  # [m] from the origin; what claims to lie further was not seen

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FilledFrame:
    """A frame in which every joint has a place.

    Attributes:
        positions: (J, 3) [m], all finite.
        filled: (J,) bool, True where the joint was not seen and its place is a guess.
    """

    positions: Array
    filled: NDArray[np.bool_]


@dataclass(slots=True, eq=False)
class _Memory:
    """What is known of one performer: offsets (J, 3) [m] of joints from their parents as last seen,
    when (J,) [s], the mean length (J,) [m] of each bone and over how many frames (J,)."""

    offsets: Array
    seen_at: Array
    lengths: Array
    counts: Array
    root: Array | None = None


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
        self, skeleton: Skeleton, *, hold: float = HOLD_SECONDS, ease: float = EASE_SECONDS
    ) -> None:
        self.skeleton = skeleton
        self.hold = hold
        self.ease = ease
        self._parents = np.where(skeleton.parents < 0, skeleton.root, skeleton.parents)
        self._rest = skeleton.rest_positions - skeleton.rest_positions[self._parents]
        self._rest_lengths = np.linalg.norm(self._rest, axis=1)
        self._memories: dict[int, _Memory] = {}

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
        if positions.shape != self._rest.shape:
            raise ValueError(f"Expected positions {self._rest.shape}, got {positions.shape}")
        near: NDArray[np.bool_] = np.abs(positions) <= FARTHEST  # False for NaN
        seen = np.logical_and.reduce(near, axis=1)
        memory = self._memory(performer, time)
        self._measure(memory, positions, seen)
        placed = np.where(seen[:, None], positions, 0.0)
        if not seen.all():
            self._place(placed, seen, self._offsets(memory, time), memory)
        self._remember(memory, placed, seen, time)
        return FilledFrame(placed, ~seen)

    def _memory(self, performer: int, time: float) -> _Memory:
        if performer not in self._memories:
            count = len(self._rest)
            long_ago = np.full(count, -np.inf)
            self._memories[performer] = _Memory(
                self._rest.copy(), long_ago, np.zeros(count), np.zeros(count)
            )
            if len(self._memories) > MOST_PERFORMERS:
                del self._memories[next(iter(self._memories))]
        memory = self._memories[performer]
        np.minimum(memory.seen_at, time, out=memory.seen_at)  # a clock that went back
        return memory

    def _measure(self, memory: _Memory, positions: Array, seen: NDArray[np.bool_]) -> None:
        bones = seen & seen[self._parents] & (self._rest_lengths > 0)
        ends = positions[bones] - positions[self._parents[bones]]
        memory.counts[bones] += 1
        step = np.linalg.norm(ends, axis=1) - memory.lengths[bones]
        memory.lengths[bones] += step / memory.counts[bones]

    def _scale(self, memory: _Memory) -> float:
        """How much larger the performer is than the rest pose."""
        bones = (memory.counts > 0) & (memory.lengths > 0)
        if not bones.any():
            return 1.0
        return float(np.median(memory.lengths[bones] / self._rest_lengths[bones]))

    def _offsets(self, memory: _Memory, time: float) -> Array:
        """(J, 3) [m] where each joint stands from its parent if it is not seen now."""
        rest = self._rest * self._scale(memory)
        age = np.maximum(time - memory.seen_at, 0.0) - self.hold
        w = np.clip(age / self.ease, 0.0, 1.0) if self.ease > 0 else (age > 0).astype(np.float64)
        return turn(memory.offsets, rest, w * w * (3.0 - 2.0 * w))

    def _place(
        self, positions: Array, seen: NDArray[np.bool_], offsets: Array, memory: _Memory
    ) -> None:
        order, parents = self.skeleton.order, self._parents
        placed = seen.copy()
        if not placed[order[0]]:
            joint = next((joint for joint in order if seen[joint]), None)
            if joint is None:
                rest_root = self.skeleton.rest_positions[order[0]] * self._scale(memory)
                positions[order[0]] = rest_root if memory.root is None else memory.root
                placed[order[0]] = True
            while joint is not None and joint != order[0]:
                positions[parents[joint]] = positions[joint] - offsets[joint]
                joint = int(parents[joint])
                placed[joint] = True
        for joint in order:
            if not placed[joint]:
                positions[joint] = positions[parents[joint]] + offsets[joint]

    def _remember(
        self, memory: _Memory, positions: Array, seen: NDArray[np.bool_], time: float
    ) -> None:
        # A joint whose parent was guessed keeps its old offset only while the guess came from it;
        # elsewhere the offset from the guess is what keeps the joint still when it disappears.
        memory.root = positions[self.skeleton.root].copy()
        memory.offsets[seen] = positions[seen] - positions[self._parents[seen]]
        memory.seen_at[seen] = time


def turn(start: Array, end: Array, weight: Array) -> Array:
    """Vectors (n, 3) from `start` to `end` by `weight` (n,) in [0, 1]: direction by slerp, length
    linearly. Opposite directions turn by way of an axis at right angles to them."""
    lengths = np.linalg.norm(start, axis=1), np.linalg.norm(end, axis=1)
    straight = (1.0 - weight)[:, None] * start + weight[:, None] * end
    valid = (lengths[0] > 1e-9) & (lengths[1] > 1e-9)
    a = start / np.where(valid, lengths[0], 1.0)[:, None]
    b = end / np.where(valid, lengths[1], 1.0)[:, None]
    cosine = np.clip(np.einsum("ij,ij->i", a, b), -1.0, 1.0)
    side = b - cosine[:, None] * a
    flat = np.linalg.norm(side, axis=1) < 1e-6
    least = np.eye(3)[np.argmin(np.abs(a), axis=1)]
    side = np.where(flat[:, None], np.cross(a, least), side)
    side /= np.maximum(np.linalg.norm(side, axis=1), 1e-12)[:, None]
    angle = (weight * np.arccos(cosine))[:, None]
    length = ((1.0 - weight) * lengths[0] + weight * lengths[1])[:, None]
    turned = length * (np.cos(angle) * a + np.sin(angle) * side)
    return np.where(valid[:, None], turned, straight)
