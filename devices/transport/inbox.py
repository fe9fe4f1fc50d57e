"""Bounded queue of frames from a device's reader thread to the frame loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable

from devices.skeleton import SkeletonFrame

CAPACITY = 4096
"""Largest number of waiting frames: 17 s of four performers at 60 Hz."""


class Bell:
    """Wakes the one thread that waits for it; it stays rung until it is stilled.

    It is a plain lock, free while it is rung. `threading.Event` runs thirty lines of Python on each
    side, which are loaded into the caches again for every frame.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lock.acquire()

    def ring(self) -> None:
        """Wake the waiting thread; only one thread at a time may ring or still."""
        if self._lock.locked():
            self._lock.release()

    def still(self) -> None:
        """Make the next `wait` block."""
        self._lock.acquire(blocking=False)

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` until it is rung, and still it; return whether it was rung."""
        return self._lock.acquire(timeout=seconds)


class Inbox:
    """Frames in order of arrival; one thread puts, another takes, neither blocks for long.

    Args:
        capacity: number of frames that are kept; beyond it the oldest is dropped and counted.

    Attributes:
        dropped: frames that were discarded before they were taken.
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
        """Wait at most `seconds` for a frame; return whether there is one."""
        return bool(self._frames) or self._filled.wait(seconds)

    def take(self) -> list[SkeletonFrame]:
        """Return every frame since the last call, oldest first."""
        with self._lock:
            frames = list(self._frames)
            self._frames.clear()
            self._filled.still()
        return frames
