"""What a character did in a take, frame by frame: its nodes, its place on the stage, its face."""

from __future__ import annotations

import hashlib
from bisect import bisect_left
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from runtime.driving.targets import Placement, PosedNodes
from solvers.skeleton.layers import LayeredNodes, LayerFrame

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Indices = NDArray[np.int64]

STILL = 1e-6  # a node that turns [rad] and shifts [m] by less than this does not move
PLACEMENT = ("turn", "x", "z", "lift", "clearance")
"""The columns of `Performance.placements`."""


@dataclass(frozen=True, eq=False)
class Performance:
    """What a character did during a take of T frames.

    Arrays are in single precision, as in the file, so that a session plays the same before it is
    saved and after it is opened.

    Attributes:
        times: (T,) [s] since the first frame, rising.
        nodes: (D,) the nodes that the take moves, ascending.
        turns: (T, D, 4) unit quaternions (x, y, z, w) in the parents' axes, from rest.
        shifts: (T, D, 3) [m] in the parents' axes, from where each node rests in its parent.
        placements: (T, 5) see `PLACEMENT`: [rad], then [m]; the clearance is NaN where there is
            none. None where the take leaves the character in its place.
        face: (T, M) weights of the morph targets; None where the take leaves the face alone.
    """

    times: Singles
    nodes: Indices
    turns: Singles
    shifts: Singles
    placements: Singles | None = None
    face: Singles | None = None

    def __post_init__(self) -> None:
        frames, nodes = len(self.times), len(self.nodes)
        if self.turns.shape != (frames, nodes, 4) or self.shifts.shape != (frames, nodes, 3):
            raise ValueError(
                f"Expected turns and shifts of {frames} frames and {nodes} nodes, got "
                f"{self.turns.shape} and {self.shifts.shape}"
            )
        if frames == 0 or (np.diff(self.times) <= 0.0).any():
            raise ValueError("Expected rising times, one at least")

    @property
    def duration(self) -> float:
        """[s] from the first frame to the last."""
        return float(self.times[-1] - self.times[0])

    @cached_property
    def key(self) -> str:
        """A name made from the content: equal performances have equal names."""
        digest = hashlib.sha256()
        for array in (
            self.times,
            self.nodes,
            self.turns,
            self.shifts,
            self.placements,
            self.face,
        ):
            digest.update(b"-" if array is None else f"{array.shape}".encode() + array.tobytes())
        return digest.hexdigest()[:20]

    def at(self, time: float) -> Moment:
        """Return what the character does at `time` [s], between two frames, or held at an end."""
        after = int(np.searchsorted(self.times, time))
        last = len(self.times) - 1
        first, second = min(max(after - 1, 0), last), min(after, last)
        step = float(self.times[second] - self.times[first])
        share = 0.0 if step <= 0.0 else min(max((time - float(self.times[first])) / step, 0.0), 1.0)
        return Moment(
            LayerFrame(
                self.nodes,
                (self.turns[first], self.turns[second]),
                (self.shifts[first], self.shifts[second]),
                share,
            ),
            None if self.placements is None else self._placement(first, second, share),
            None if self.face is None else _between(self.face, first, second, share),
        )

    def _placement(self, first: int, second: int, share: float) -> Placement:
        assert self.placements is not None
        turn, x, z, lift, clearance = _between(self.placements, first, second, share).tolist()
        return Placement(turn, (x, z), lift, None if np.isnan(clearance) else clearance)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What a take makes of a character at one moment.

    Attributes:
        nodes: the nodes that it moves.
        placement: where the whole character is; None where the take does not say.
        face: (M,) weights of the morph targets; None where the take does not say.
    """

    nodes: LayerFrame
    placement: Placement | None
    face: Array | None


@dataclass(slots=True, eq=False)
class PerformanceRecorder:
    """Collects what a character does, from one frame to the next.

    Args:
        layered: of the character's tree of nodes; used to take turns apart.
        named: nodes that count as moved by the take even while they stand still.
    """

    layered: LayeredNodes
    named: frozenset[int] = frozenset()
    _times: list[float] = field(default_factory=list)
    _turns: list[Singles] = field(default_factory=list)
    _shifts: list[Singles] = field(default_factory=list)
    _placements: list[Singles] = field(default_factory=list)
    _faces: list[Singles] = field(default_factory=list)

    def add(self, time: float, nodes: PosedNodes, placement: Placement, face: Array) -> None:
        """Take in one frame at `time` [s]; one that is not later than the last is left out."""
        if self._times and np.float32(time - self._times[0]) <= np.float32(
            self._times[-1] - self._times[0]
        ):
            return
        turns, shifts = self.layered.local(nodes.positions, nodes.rotations)
        self._times.append(time)
        self._turns.append(turns.astype(np.float32))
        self._shifts.append(shifts.astype(np.float32))
        self._placements.append(_row(placement))
        self._faces.append(face.astype(np.float32))

    @property
    def seconds(self) -> float:
        """[s] from the first frame to the newest."""
        return self._times[-1] - self._times[0] if self._times else 0.0

    def forget(self, before: float) -> None:
        """Drop the frames before a time [s]."""
        first = bisect_left(self._times, before)
        for frames in (self._times, self._turns, self._shifts, self._placements, self._faces):
            del frames[:first]

    def performance(self) -> Performance | None:
        """Return what was collected, of the nodes that moved or were named; None of no frame."""
        if not self._times:
            return None
        turns, shifts = np.array(self._turns), np.array(self._shifts)
        moved = 2.0 * np.linalg.norm(turns[..., :3], axis=2).max(axis=0) > STILL
        moved |= np.abs(shifts).max(axis=(0, 2)) > STILL
        moved[list(self.named)] = True
        nodes = np.flatnonzero(moved)
        placements, faces = np.array(self._placements), np.array(self._faces)
        still = not np.nan_to_num(placements).any() and np.isnan(placements[:, 4]).all()
        placements[:, 0] = np.unwrap(placements[:, 0].astype(np.float64))
        return Performance(
            (np.array(self._times) - self._times[0]).astype(np.float32),
            nodes,
            turns[:, nodes],
            shifts[:, nodes],
            None if still else placements,
            faces if faces.any() else None,
        )


def _row(placement: Placement) -> Singles:
    """A placement as a row of `Performance.placements`."""
    clearance = np.nan if placement.clearance is None else placement.clearance
    row: Singles = np.array(
        [placement.turn, *placement.travel, placement.lift, clearance], dtype=np.float32
    )
    return row


def _between(rows: Singles, first: int, second: int, share: float) -> Array:
    """A share of the way between two rows; what only one of them has is that one's."""
    start: Array = rows[first].astype(np.float64)
    end: Array = rows[second].astype(np.float64)
    if share <= 0.0 or first == second:
        return start
    row: Array = (1.0 - share) * start + share * end
    known: Array = np.where(np.isnan(row), start if share < 0.5 else end, row)
    return known
