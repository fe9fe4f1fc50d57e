"""Treats performers whose frames stop as unseen, so that their characters ease to rest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from devices.skeleton import Skeleton, SkeletonFrame
from replay.fill import EASE_SECONDS, KEEP_SECONDS

SILENT = 0.3  # [s] without a frame, longer than a hitch of a sensor or of the network
AT_REST = KEEP_SECONDS + EASE_SECONDS + SILENT  # [s] after which nothing moves any more


@dataclass(frozen=True, slots=True)
class SilenceState:
    """The newest frame of each slot; None where there was none."""

    newest: tuple[SkeletonFrame | None, ...]


class Silence:
    """Makes frames without joints for the slots whose performers have stopped sending.

    Args:
        slots: how many performers drive.
    """

    def __init__(self, slots: int) -> None:
        self._newest: list[SkeletonFrame | None] = [None] * slots

    def snapshot(self) -> SilenceState:
        """Return the newest frame of each slot."""
        return SilenceState(tuple(self._newest))

    def restore(self, state: SilenceState) -> None:
        """Go back to a snapshot."""
        self._newest = list(state.newest)

    @property
    def newest_time(self) -> float:
        """[s] of the newest frame of any performer; NaN before the first."""
        return max((frame.time for frame in self._newest if frame is not None), default=math.nan)

    def unseen(self, of_slots: Mapping[int, SkeletonFrame], now: float) -> dict[int, SkeletonFrame]:
        """Return frames without joints at `now` [s] for silent slots, until all is at rest.

        Args:
            of_slots: the frames that have come.
            now: [s] the performers' time.
        """
        for slot, frame in of_slots.items():
            self._newest[slot] = frame
        return {
            slot: _nobody(frame, now)
            for slot, frame in enumerate(self._newest)
            if frame is not None and SILENT < now - frame.time < AT_REST + SILENT
        }


def nobody(skeleton: Skeleton, time: float) -> SkeletonFrame:
    """Return a frame at `time` [s] of which no joint is seen."""
    joints = len(skeleton.names)
    return SkeletonFrame(
        time=time,
        positions=np.full((joints, 3), np.nan),
        rotations=None,
        confidence=np.zeros(joints),
    )


def _nobody(frame: SkeletonFrame, time: float) -> SkeletonFrame:
    """A frame of the same performer of which no joint is seen."""
    return SkeletonFrame(
        time=time,
        positions=np.full_like(frame.positions, np.nan),
        rotations=None if frame.rotations is None else np.full_like(frame.rotations, np.nan),
        confidence=np.zeros_like(frame.confidence),
        performer=frame.performer,
    )
