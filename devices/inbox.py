"""The bounded hand-over of frames from a device's reader thread to the frame loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable

from devices.skeleton import SkeletonFrame

CAPACITY = 4096
"""Frames that wait at most: 17 s of four performers at 60 Hz, should the loop stand that long."""


class Inbox:
    """Frames in the order in which they came; one thread puts, another takes, neither waits long.

    Args:
        capacity: how many frames are kept; when one more comes the oldest is dropped and counted.

    Attributes:
        dropped: frames that nobody took in time.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self.dropped = 0
        self._frames: deque[SkeletonFrame] = deque(maxlen=capacity)
        self._lock = threading.Lock()
        self._filled = threading.Event()

    def put(self, frames: Iterable[SkeletonFrame]) -> None:
        """Add frames, the newest last."""
        with self._lock:
            for frame in frames:
                self.dropped += len(self._frames) == self._frames.maxlen
                self._frames.append(frame)
            if self._frames:
                self._filled.set()

    def wait(self, seconds: float) -> bool:
        """Sleep until a frame is there, at most so long; whether one is."""
        return self._filled.wait(seconds)

    def take(self) -> list[SkeletonFrame]:
        """Every frame since the last call, oldest first."""
        with self._lock:
            frames = list(self._frames)
            self._frames.clear()
            self._filled.clear()
        return frames
