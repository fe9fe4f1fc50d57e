"""Output that publishes the performers of a show to other shows, over a bridge."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from typing import Self

import numpy as np

from devices.skeleton import SkeletonFrame
from runtime.driving.performer import Pose
from runtime.output.live.bridge_publisher import BridgePublisher
from runtime.output.output import PerformedFrame

GUESSED = 0.5
"""Confidence of a joint that was filled in or corrected, as of a Kinect's inferred joints."""
FAR = 60.0  # [s] from the host's clock; beyond that, the times are those of a recording


class BridgePerformer:
    """Publishes every pose of every performer, independent of the characters that they drive.

    Args:
        publisher: sends each pose with its performer's number; it is closed with this output.
        clock: host monotonic time [s]. The times of a show that runs on another clock, such as a
            recording with --fast, are shifted to it.
    """

    pictures_a_second = 0.0

    def __init__(
        self,
        publisher: BridgePublisher,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._publisher = publisher
        self._clock = clock
        self._shift = math.nan
        self._last: tuple[Pose | None, ...] = ()

    def write(self, frame: PerformedFrame) -> None:
        """Publish the poses that changed since the last frame, oldest first."""
        pairs = itertools.zip_longest(frame.poses, self._last)
        fresh = [pose for pose, last in pairs if pose is not None and pose is not last]
        self._last = frame.poses
        now = self._clock()
        if fresh and math.isnan(self._shift):
            away = now - frame.time
            self._shift = away if abs(away) > FAR else 0.0
        for pose in sorted(fresh, key=lambda pose: pose.time):
            self._publisher.write(
                SkeletonFrame(
                    time=min(pose.time + self._shift, now),
                    positions=pose.seen,
                    rotations=None,
                    confidence=np.where(pose.filled | pose.corrected, GUESSED, 1.0),
                    performer=pose.performer,
                    blends=pose.blends,
                )
            )

    def close(self) -> None:
        """Stop publishing; may be called twice."""
        self._publisher.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
