"""Takes the frames of each performer through all steps of conditioning, in the package's order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.skeleton import Skeleton, SkeletonFrame
from replay.fill import Filler, FillerState
from runtime.conditioning.body_anatomy import BodyAnatomy, body_anatomy
from runtime.conditioning.calibration_pose import CalibrationPose, CalibrationPoseState
from runtime.conditioning.exact_joints import ExactJoints, ExactJointsState
from runtime.conditioning.faults import Faults, FaultsState
from runtime.conditioning.guesses import seen_only
from runtime.conditioning.levelling import Levelling, LevellingState
from runtime.conditioning.mirror import mirrored
from runtime.conditioning.rejoining import Rejoining, RejoiningState
from runtime.conditioning.stature import Stature, StatureState
from runtime.conditioning.switches import SWITCHES, Conditioning
from solvers.signal.one_euro import OneEuroFilter, OneEuroState
from solvers.signal.prediction import Predictor, PredictorState

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

LONGEST_GAP = 1.0  # [s] between frames, after which smoothing and prediction start anew
MOST_PERFORMERS = 64  # remembered at once


@dataclass(frozen=True, slots=True, eq=False)
class ConditionedFrame:
    """A frame after all steps, with flags for each correction.

    Attributes:
        positions: (J, 3) [m], all finite.
        filled: (J,) bool, the joint was not seen, or was rejected: its place is a guess.
        corrected: (J,) bool, the joint was seen elsewhere: rejected, or exchanged with its partner.
        predicted: (J,) bool, the place is predicted one frame ahead.
        mirrored: whether left and right are exchanged.
        scaled: whether the performer was scaled to the size of the skeleton's rest pose.
        scale: the factor of that.
    """

    positions: Array
    filled: Bools
    corrected: Bools
    predicted: Bools
    mirrored: bool
    scaled: bool
    scale: float


@dataclass(frozen=True, slots=True, eq=False)
class PerformerMemoryState:
    """The states of all steps for one performer, and the last frame's time [s]."""

    exact: ExactJointsState
    faults: FaultsState
    rejoining: RejoiningState
    filter: OneEuroState
    predictor: PredictorState
    stature: StatureState
    calibration: CalibrationPoseState
    at: float


class _PerformerMemory:
    """The steps that remember one performer, and the last frame's time [s]."""

    def __init__(self, skeleton: Skeleton, body: BodyAnatomy) -> None:
        count = len(skeleton.names)
        self.exact = ExactJoints(skeleton)
        self.faults = Faults(body, count)
        self.rejoining = Rejoining(count)
        self.filter = OneEuroFilter()
        self.predictor = Predictor()
        self.stature = Stature(skeleton)
        self.calibration = CalibrationPose(skeleton)
        self.at = float("nan")

    def snapshot(self) -> PerformerMemoryState:
        """Return the states of all steps."""
        return PerformerMemoryState(
            self.exact.snapshot(),
            self.faults.snapshot(),
            self.rejoining.snapshot(),
            self.filter.snapshot(),
            self.predictor.snapshot(),
            self.stature.snapshot(),
            self.calibration.snapshot(),
            self.at,
        )

    def restore(self, state: PerformerMemoryState) -> None:
        """Go back to a snapshot."""
        self.exact.restore(state.exact)
        self.faults.restore(state.faults)
        self.rejoining.restore(state.rejoining)
        self.filter.restore(state.filter)
        self.predictor.restore(state.predictor)
        self.stature.restore(state.stature)
        self.calibration.restore(state.calibration)
        self.at = state.at


@dataclass(frozen=True, slots=True, eq=False)
class ConditionerState:
    """The memory of a conditioner.

    Attributes:
        levelling: the floor.
        filler: the unseen joints.
        performers: (number, state) of each performer, the first seen first.
        calibrates: as of `Conditioner`.
    """

    levelling: LevellingState
    filler: FillerState
    performers: tuple[tuple[int, PerformerMemoryState], ...]
    calibrates: bool


class Conditioner:
    """Conditions the frames of one skeleton; remembers each performer separately.

    Args:
        skeleton: of all frames.
        switches: which steps are taken; read for every frame.

    Attributes:
        levelling: the floor of this stream.
        calibrates: whether the newest frame completes a calibration pose kept still.
    """

    def __init__(self, skeleton: Skeleton, switches: Conditioning) -> None:
        self.switches = switches
        self.calibrates = False
        self._skeleton = skeleton
        self._body = body_anatomy(skeleton)
        self.levelling = Levelling(self._body)
        self._filler = Filler(skeleton)
        self._memories: dict[int, _PerformerMemory] = {}
        self._nothing = np.zeros(len(skeleton.names), dtype=bool)

    @property
    def partner(self) -> NDArray[np.int64]:
        """(J,) the same joint of the other side; a joint in the middle is its own."""
        return self._body.partner

    def snapshot(self) -> ConditionerState:
        """Return the memory of the floor and of all performers."""
        return ConditionerState(
            self.levelling.snapshot(),
            self._filler.snapshot(),
            tuple((number, memory.snapshot()) for number, memory in self._memories.items()),
            self.calibrates,
        )

    def restore(self, state: ConditionerState) -> None:
        """Go back to a snapshot of a conditioner of the same skeleton."""
        self.levelling.restore(state.levelling)
        self._filler.restore(state.filler)
        self._memories = {}
        for number, of_performer in state.performers:
            self._memories[number] = _PerformerMemory(self._skeleton, self._body)
            self._memories[number].restore(of_performer)
        self.calibrates = state.calibrates

    def recalibrate(self) -> None:
        """Measure floor and stature anew."""
        self.levelling.forget()
        for memory in self._memories.values():
            memory.stature.forget()

    def condition(self, frame: SkeletonFrame) -> ConditionedFrame:
        """Return the frame mended, filled, smoothed and in the stage's space.

        Raises:
            ValueError: the frame does not have the skeleton's number of joints.
        """
        on, memory = self.switches, self._memory(frame.performer)
        dt = frame.time - memory.at
        memory.at = frame.time
        positions, corrected, predicted = frame.positions, self._nothing, self._nothing
        if on.swaps or on.outliers:
            measured = not memory.exact.watch(positions, frame.rotations)
            if on.outliers:
                positions = seen_only(positions, frame.confidence)
            swaps, outliers = on.swaps and measured, on.outliers and measured
            mended = memory.faults.mend(positions, frame.time, swaps=swaps, outliers=outliers)
            positions, corrected = mended.positions, mended.corrected
        whole = self._filler.place(positions, frame.time, frame.performer)
        positions, filled = whole.positions, whole.filled
        if on.outliers:
            positions, late = memory.rejoining.blend(positions, filled, frame.time)
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

    def _memory(self, performer: int) -> _PerformerMemory:
        memory = self._memories.get(performer)
        if memory is None:
            memory = _PerformerMemory(self._skeleton, self._body)
            self._memories[performer] = memory
            if len(self._memories) > MOST_PERFORMERS:
                del self._memories[next(iter(self._memories))]
        return memory

    def _smooth(self, memory: _PerformerMemory, positions: Array, dt: float) -> Array:
        if not abs(dt) <= LONGEST_GAP:
            memory.filter.reset()
            memory.predictor.reset()
        if self.switches.filter:
            return memory.filter.filter(positions, dt)
        memory.filter.reset()
        return positions

    def _on_stage(
        self, positions: Array, filled: Bools, memory: _PerformerMemory, time: float
    ) -> tuple[Array, float]:
        """Return positions levelled and scaled as switched on, and the factor of the scaling."""
        on, scale = self.switches, 1.0
        if on.level:
            self.levelling.watch(positions, filled, time)
            positions = self.levelling.level(positions)
        memory.stature.watch(positions, filled, time)
        if on.scale:
            scale = memory.stature.factor
            positions = positions if scale == 1.0 else positions * scale
        self.calibrates = on.recalibrate and memory.calibration.watch(positions, filled, time)
        return positions, scale


@lru_cache(maxsize=1)
def warm(skeleton: Skeleton) -> None:
    """Take every step once, so that compiling and loading delay no frame of a show."""
    conditioner = Conditioner(skeleton, Conditioning(**dict.fromkeys(SWITCHES, True)))
    rest, seen = skeleton.rest_positions, np.ones(len(skeleton.names))
    for time in (0.0, 0.2):  # two looks at the feet
        conditioner.condition(SkeletonFrame(time, rest, None, seen))
    conditioner.condition(SkeletonFrame(0.4, np.full_like(rest, np.nan), None, 0.0 * seen))
