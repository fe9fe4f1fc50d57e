"""Received frames that wait for the frame loop: the newest of each performer, or all frames."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Protocol

from devices.skeleton import SkeletonFrame
from devices.transport.inbox import Bell, Inbox

PERFORMERS = 256


class FrameQueue(Protocol):
    """A queue of frames: one thread puts, another takes."""

    @property
    def dropped(self) -> int:
        """Frames that were discarded before they were taken."""
        ...

    def put(self, frames: Iterable[SkeletonFrame]) -> None:
        """Add frames, the newest last."""
        ...

    def take(self) -> list[SkeletonFrame]:
        """Return every waiting frame, oldest first."""
        ...

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` for a frame; return whether there is one."""
        ...

    @property
    def waiting(self) -> int:
        """Frames in the queue that reduce the credit given to the publisher."""
        ...


class LatestFrames:
    """The newest frame of each performer; a newer frame replaces it, and the old one is dropped."""

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
        """Wait at most `seconds` for a frame; return whether there is one."""
        return bool(self._frames) or self._filled.wait(seconds)

    def take(self) -> list[SkeletonFrame]:
        """Return the newest frame of each performer that has moved, oldest first."""
        with self._lock:
            frames = list(self._frames.values())
            self._frames.clear()
            self._filled.still()
        return frames


class AllFrames(Inbox):
    """All frames. Waiting frames reduce the publisher's credit, so that none is dropped."""

    @property
    def waiting(self) -> int:
        """Frames that have not been taken yet."""
        return len(self._frames)
