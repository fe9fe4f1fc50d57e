"""What waits on the stage until the loop asks: the newest frame of each performer, or all."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Protocol

from devices.skeleton import SkeletonFrame
from devices.transport.inbox import Bell, Inbox

PERFORMERS = 256


class FrameQueue(Protocol):
    """One thread puts, another takes."""

    @property
    def dropped(self) -> int:
        """Frames that nobody took in time."""
        ...

    def put(self, frames: Iterable[SkeletonFrame]) -> None:
        """Add frames, the newest last."""
        ...

    def take(self) -> list[SkeletonFrame]:
        """Every frame that waits, oldest first."""
        ...

    def wait(self, seconds: float) -> bool:
        """Sleep until a frame is there, at most so long; whether one is."""
        ...

    @property
    def waiting(self) -> int:
        """Frames that the bridge must wait for to be taken."""
        ...


class LatestFrames:
    """The newest frame of each performer; a newer one takes its place, and the old is dropped."""

    waiting = 0

    def __init__(self) -> None:
        self.dropped = 0
        self._frames: dict[int, SkeletonFrame] = {}
        self._lock = threading.Lock()
        self._filled = Bell()

    def put(self, frames: Iterable[SkeletonFrame]) -> None:
        """Add frames, the newest last."""
        with self._lock:
            for frame in frames:
                self.dropped += self._frames.pop(frame.performer, None) is not None
                if len(self._frames) >= PERFORMERS:
                    self._frames.pop(next(iter(self._frames)))
                    self.dropped += 1
                self._frames[frame.performer] = frame
            if self._frames:
                self._filled.ring()

    def wait(self, seconds: float) -> bool:
        """Sleep until a frame is there, at most so long; whether one is."""
        return bool(self._frames) or self._filled.wait(seconds)

    def take(self) -> list[SkeletonFrame]:
        """One frame of each performer that has moved, oldest first."""
        with self._lock:
            frames = list(self._frames.values())
            self._frames.clear()
            self._filled.still()
        return frames


class AllFrames(Inbox):
    """Every frame; as many as wait here the bridge sends fewer, so that none is dropped."""

    @property
    def waiting(self) -> int:
        """Frames that nobody has taken yet."""
        return len(self._frames)
