"""Wait for what another thread or process does; the limit only ends a test that hangs."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from devices.skeleton import SkeletonFrame

PATIENCE = 300.0  # [s] far beyond what a busy machine needs
GLANCE = 0.002  # [s] between two looks


class Polled(Protocol):
    """A stream that frames are taken from."""

    def poll(self) -> Sequence[SkeletonFrame]:
        """The frames that have come since the last poll."""
        ...


def until(condition: Callable[[], bool], told: Callable[[], object] = lambda: "") -> None:
    """Return as soon as a condition holds; fail with what is `told` where it never does."""
    end, pause = time.monotonic() + PATIENCE, threading.Event()
    while not condition():
        assert time.monotonic() < end, f"it never came to that: {told()}"
        pause.wait(GLANCE)


def frames_of(stream: Polled, count: int) -> list[SkeletonFrame]:
    """The next frames of a stream, at least `count` of them."""
    frames: list[SkeletonFrame] = []

    def enough() -> bool:
        frames.extend(stream.poll())
        return len(frames) >= count

    until(enough, lambda: getattr(stream, "traffic", len(frames)))
    return frames
