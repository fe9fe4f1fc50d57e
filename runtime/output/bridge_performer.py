"""The performer of a show for other shows: what drives the characters, over a bridge."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Self

import numpy as np

from devices.skeleton import SkeletonFrame
from runtime.output.bridge_publisher import BridgePublisher
from runtime.output.output import PerformedFrame
from runtime.performer import Performer, Pose

GUESSED = 0.5
"""Confidence of a joint that was filled in or put right, as of one that a Kinect inferred."""
FAR = 60.0  # [s] from the host's clock; a time further off is a recording's own


class BridgePerformer:
    """An output that publishes each pose of the performer, whatever character follows it.

    Args:
        performer: whose poses they are, put in order and without gaps.
        publisher: is closed with this.
        clock: host monotonic time [s]; a show that is not on it, as fast as it can, is moved there.
    """

    pictures_a_second = 0.0

    def __init__(
        self,
        performer: Performer,
        publisher: BridgePublisher,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._performer = performer
        self._publisher = publisher
        self._clock = clock
        self._shift = math.nan
        self._last: Pose | None = None

    def write(self, frame: PerformedFrame) -> None:
        """Publish the performer's pose at this frame, if it is another than the last."""
        pose = self._performer.pose
        if pose is None or pose is self._last:
            return
        self._last = pose
        now = self._clock()
        if math.isnan(self._shift):
            away = now - frame.time
            self._shift = away if abs(away) > FAR else 0.0
        self._publisher.write(
            SkeletonFrame(
                time=min(frame.time + self._shift, now),
                positions=pose.seen,
                rotations=None,
                confidence=np.where(pose.filled | pose.corrected, GUESSED, 1.0),
            )
        )

    def close(self) -> None:
        """Publish no more; may be called twice."""
        self._publisher.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
