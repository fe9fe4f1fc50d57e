"""One body's frame through all steps, in the order that the package gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame
from replay.fill import Filler
from runtime.conditioning.body_anatomy import body_anatomy
from runtime.conditioning.calibration_pose import CalibrationPose
from runtime.conditioning.faults import Faults
from runtime.conditioning.levelling import Levelling
from runtime.conditioning.mirror import mirrored
from runtime.conditioning.rejoining import Rejoining
from runtime.conditioning.stature import Stature
from runtime.conditioning.switches import SWITCHES, Conditioning
from solvers.signal.one_euro import OneEuroFilter
from solvers.signal.prediction import Predictor

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
        self, faults: Faults, rejoining: Rejoining, stature: Stature, held: CalibrationPose
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
        self._body = body_anatomy(skeleton)
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
        positions, corrected, predicted = frame.positions, self._nothing, self._nothing
        if on.swaps or on.outliers:
            mended = memory.faults.mend(positions, frame.time, swaps=on.swaps, outliers=on.outliers)
            positions, corrected = mended.positions, mended.corrected
        whole = self._filler.place(positions, frame.time, frame.performer)
        positions, filled = whole.positions, whole.filled
        if on.outliers:
            positions, late = memory.rejoining.lead(positions, filled, frame.time)
            corrected = corrected | late
        else:
            memory.rejoining.forget()
        positions = self._smooth(memory, positions, dt)
        if on.predict:
            ahead = memory.predictor.predict(positions, dt)
            positions, predicted = np.where(filled[:, None], positions, ahead), ~filled
        else:
            memory.predictor.reset()
        positions, scale = self._on_stage(positions, filled, memory, frame.time)
        flags = filled, corrected, predicted
        if mirror := on.mirror:
            other = self._body.partner
            positions = mirrored(positions, other)
            flags = filled[other], corrected[other], predicted[other]
        return ConditionedFrame(positions, *flags, mirror, on.scale, scale)

    def _memory(self, performer: int) -> _Memory:
        memory = self._memories.get(performer)
        if memory is None:
            count = len(self._skeleton.names)
            faults, rejoining = Faults(self._body, count), Rejoining(count)
            memory = _Memory(
                faults, rejoining, Stature(self._skeleton), CalibrationPose(self._skeleton)
            )
            self._memories[performer] = memory
            if len(self._memories) > MOST_PERFORMERS:
                del self._memories[next(iter(self._memories))]
        return memory

    def _smooth(self, memory: _Memory, positions: Array, dt: float) -> Array:
        if not abs(dt) <= LONGEST_GAP:
            memory.filter.reset()
            memory.predictor.reset()
        if self.switches.filter:
            return memory.filter.filter(positions, dt)
        memory.filter.reset()
        return positions

    def _on_stage(
        self, positions: Array, filled: Bools, memory: _Memory, time: float
    ) -> tuple[Array, float]:
        """Level, and as tall as everybody, as asked for; and how many times as tall as before."""
        on, scale = self.switches, 1.0
        if on.level:
            self.levelling.watch(positions, filled, time)
            positions = self.levelling.level(positions)
        memory.stature.watch(positions, filled, time)
        if on.scale:
            scale = memory.stature.factor
            positions = positions if scale == 1.0 else positions * scale
        self.held = on.recalibrate and memory.held.watch(positions, filled, time)
        return positions, scale


@lru_cache(maxsize=1)
def warm(skeleton: Skeleton) -> None:
    """Take every step once, so that no frame of a show waits for one to be compiled or loaded."""
    conditioner = Conditioner(skeleton, Conditioning(**dict.fromkeys(SWITCHES, True)))
    rest, seen = skeleton.rest_positions, np.ones(len(skeleton.names))
    for time in (0.0, 0.2):  # two looks at the feet
        conditioner.condition(SkeletonFrame(time, rest, None, seen))
    conditioner.condition(SkeletonFrame(0.4, np.full_like(rest, np.nan), None, 0.0 * seen))
