"""One body's frame through all steps, in the order that the package gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame
from replay.fill import FARTHEST, Filler
from runtime.conditioning.body import body_of
from runtime.conditioning.faults import Faults
from runtime.conditioning.held_pose import HeldPose
from runtime.conditioning.levelling import Levelling
from runtime.conditioning.mirror import mirrored
from runtime.conditioning.rejoining import Rejoining
from runtime.conditioning.stature import Stature
from runtime.conditioning.switches import Conditioning
from solvers.one_euro import OneEuroFilter
from solvers.prediction import Predictor

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

LONGEST_GAP = 1.0  # [s] after which motion is smoothed and predicted anew
MOST_PERFORMERS = 64  # that are remembered


@dataclass(frozen=True, slots=True, eq=False)
class ConditionedFrame:
    """A frame that can be trusted, and what was done to it.

    Attributes:
        positions: (J, 3) [m], all finite.
        filled: (J,) bool, the joint was not seen, or seen and not believed: its place is a guess.
        corrected: (J,) bool, the joint was seen elsewhere: not believed, or called its partner.
        predicted: (J,) bool, the place is where the joint will be one frame later.
        mirrored: whether left is right.
        scaled: whether lengths were made those of the skeleton's rest pose.
        scale: what they were multiplied by.
    """

    positions: Array
    filled: Bools
    corrected: Bools
    predicted: Bools
    mirrored: bool
    scaled: bool
    scale: float


class _Memory:
    """What is remembered of one performer."""

    def __init__(
        self, faults: Faults, rejoining: Rejoining, stature: Stature, held: HeldPose
    ) -> None:
        self.faults = faults
        self.rejoining = rejoining
        self.filter = OneEuroFilter()
        self.predictor = Predictor()
        self.stature = stature
        self.held = held
        self.at = float("nan")


class Conditioner:
    """Conditions frames of one skeleton; remembers each performer apart.

    Args:
        skeleton: of all frames.
        switches: what is done; looked at for every frame.

    Attributes:
        levelling: the floor of this stream.
        held: whether a T or A pose has been held, in the newest frame for the first time.
    """

    def __init__(self, skeleton: Skeleton, switches: Conditioning) -> None:
        self.switches = switches
        self.held = False
        self._skeleton = skeleton
        self._body = body_of(skeleton)
        self.levelling = Levelling(self._body)
        self._filler = Filler(skeleton)
        self._memories: dict[int, _Memory] = {}
        self._nothing = np.zeros(len(skeleton.names), dtype=bool)

    @property
    def partner(self) -> NDArray[np.int64]:
        """(J,) of each joint the same one of the other side; itself in the middle."""
        return self._body.partner

    def recalibrate(self) -> None:
        """Measure floor and stature anew."""
        self.levelling.forget()
        for memory in self._memories.values():
            memory.stature.forget()

    def condition(self, frame: SkeletonFrame) -> ConditionedFrame:
        """The frame, mended, filled, smoothed and in the stage's space.

        Raises:
            ValueError: the frame has not the skeleton's number of joints.
        """
        on, memory = self.switches, self._memory(frame.performer)
        dt = frame.time - memory.at
        memory.at = frame.time
        positions, corrected = frame.positions, self._nothing
        if on.swaps or on.outliers:
            positions, corrected = self._mend(memory, frame)
        whole = self._filler.place(positions, frame.time, frame.performer)
        positions, predicted = whole.positions, self._nothing
        if on.outliers:
            positions, late = memory.rejoining.lead(positions, whole.filled, frame.time)
            corrected = corrected | late
        else:
            memory.rejoining.forget()
        positions = self._smooth(memory, positions, dt)
        if on.predict:
            ahead = memory.predictor.predict(positions, dt)
            positions = np.where(whole.filled[:, None], positions, ahead)
            predicted = ~whole.filled
        else:
            memory.predictor.reset()
        placed = ConditionedFrame(positions, whole.filled, corrected, predicted, False, False, 1.0)
        return self._on_stage(placed, memory, frame.time)

    def _memory(self, performer: int) -> _Memory:
        memory = self._memories.get(performer)
        if memory is None:
            count = len(self._skeleton.names)
            faults, rejoining = Faults(self._body, count), Rejoining(count)
            memory = _Memory(faults, rejoining, Stature(self._skeleton), HeldPose(self._skeleton))
            self._memories[performer] = memory
            if len(self._memories) > MOST_PERFORMERS:
                del self._memories[next(iter(self._memories))]
        return memory

    def _mend(self, memory: _Memory, frame: SkeletonFrame) -> tuple[Array, Bools]:
        on = self.switches
        near = np.logical_and.reduce(np.abs(frame.positions) <= FARTHEST, axis=1)
        positions = np.where(near[:, None], frame.positions, np.nan)
        mended = memory.faults.mend(positions, frame.time, swaps=on.swaps, outliers=on.outliers)
        return mended.positions, mended.exchanged | mended.rejected

    def _smooth(self, memory: _Memory, positions: Array, dt: float) -> Array:
        if not abs(dt) <= LONGEST_GAP:
            memory.filter.reset()
            memory.predictor.reset()
        if self.switches.filter:
            return memory.filter.filter(positions, dt)
        memory.filter.reset()
        return positions

    def _on_stage(self, frame: ConditionedFrame, memory: _Memory, time: float) -> ConditionedFrame:
        """Level, mirrored and as tall as everybody, as asked for."""
        on, positions, scale = self.switches, frame.positions, 1.0
        if on.level:
            self.levelling.watch(positions, frame.filled, time)
            positions = self.levelling.level(positions)
        memory.stature.watch(positions, frame.filled, time)
        if on.scale:
            scale = memory.stature.factor
            positions = positions if scale == 1.0 else positions * scale
        self.held = on.recalibrate and memory.held.watch(positions, frame.filled, time)
        mirror, other = on.mirror, self._body.partner
        if not mirror:
            flags = frame.filled, frame.corrected, frame.predicted
        else:
            positions = mirrored(positions, other)
            flags = frame.filled[other], frame.corrected[other], frame.predicted[other]
        return ConditionedFrame(positions, *flags, mirror, on.scale, scale)
