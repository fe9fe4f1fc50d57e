"""The bounded hand-over of frames from a device's reader thread to the frame loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable

from devices.skeleton import SkeletonFrame

CAPACITY = 4096
"""Frames that wait at most: 17 s of four performers at 60 Hz, should the loop stand that long."""


class Bell:
    """Wakes the one thread that waits for it, and stays rung until it is stilled.

    It is a bare lock, free while it is rung. `threading.Event` runs thirty lines of Python on
    either side of the hand-over, which are fetched anew for every frame.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lock.acquire()

    def ring(self) -> None:
        """Wake who waits; one thread at a time may ring or still."""
        if self._lock.locked():
            self._lock.release()

    def still(self) -> None:
        """Let the next one wait."""
        self._lock.acquire(blocking=False)

    def wait(self, seconds: float) -> bool:
        """Sleep until it is rung, at most so long, and still it; whether it was rung."""
        return self._lock.acquire(timeout=seconds)


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
        self._filled = Bell()

    def put(self, frames: Iterable[SkeletonFrame]) -> None:
        """Add frames, the newest last."""
        with self._lock:
            for frame in frames:
                self.dropped += len(self._frames) == self._frames.maxlen
                self._frames.append(frame)
            if self._frames:
                self._filled.ring()

    def wait(self, seconds: float) -> bool:
        """Sleep until a frame is there, at most so long; whether one is."""
        return bool(self._frames) or self._filled.wait(seconds)

    def take(self) -> list[SkeletonFrame]:
        """Every frame since the last call, oldest first."""
        with self._lock:
            frames = list(self._frames)
            self._frames.clear()
            self._filled.still()
        return frames
