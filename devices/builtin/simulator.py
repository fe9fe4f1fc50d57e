"""Device ``sim://show``, ``sim://wave`` and so on: built-in motions that loop without end.

Option: ``performers=N``; they stand side by side, each one second behind the previous.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Self
from urllib.parse import SplitResult

import numpy as np

from devices.address import options_of
from devices.builtin.gestures import RATE, MotionClip
from devices.builtin.motions import MOTIONS, motion_clip
from devices.skeleton import Skeleton, SkeletonFrame

BACKLOG_SECONDS = 1.0
"""Frames that are older than this at a poll are skipped."""
MOST_PERFORMERS = 64
_APART = 1.2  # [m] between one performer and the next


class Simulator:
    """A live source of motion without a sensor: 60 frames per second on the host's clock.

    Args:
        clip: the frames to repeat.
        performers: number of performers.
        clock: host monotonic time [s]; the motion begins with the first poll.
    """

    def __init__(
        self,
        clip: MotionClip,
        clock: Callable[[], float] = time.perf_counter,
        *,
        performers: int = 1,
    ) -> None:
        self._clip = clip
        self._performers = range(performers)
        self._clock = clock
        self._start: float | None = None
        self._next = 0
        self._closed = False

    @property
    def skeleton(self) -> Skeleton:
        """The built-in skeleton, the same for every motion."""
        return self._clip.skeleton

    @property
    def ended(self) -> bool:
        """True only once it is closed."""
        return self._closed

    def poll(self) -> Sequence[SkeletonFrame]:
        """Return every frame that is due, oldest first, at most those of the last second."""
        if self._closed:
            return []
        now = self._clock()
        if self._start is None:
            self._start = now
        # The margin keeps a clock that ticks in frames from losing one by rounding.
        due = int((now - self._start) * RATE + 1e-6) + 1
        first = max(self._next, due - int(BACKLOG_SECONDS * RATE))
        self._next = max(self._next, due)
        return [
            self._frame(number, performer, self._start, now)
            for number in range(first, due)
            for performer in self._performers
        ]

    def _frame(self, number: int, performer: int, start: float, now: float) -> SkeletonFrame:
        index = (number - performer * int(RATE)) % len(self._clip.times)
        aside = np.array([_APART * ((performer + 1) // 2) * (-1) ** performer, 0.0, 0.0])
        return SkeletonFrame(
            time=start + number / RATE,
            positions=self._clip.positions[index] + aside,
            rotations=self._clip.rotations[index],
            confidence=np.ones(len(self.skeleton.names)),
            performer=performer,
            arrival=now,
        )

    def close(self) -> None:
        """End the stream."""
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def open_device(address: SplitResult) -> Simulator:
    """Open ``sim://MOTION``; without a name, the first motion."""
    options = options_of(address, {"performers": _performer_count})
    return Simulator(motion_clip(address.netloc or MOTIONS[0]), **options)


def _performer_count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and 1 <= int(text[:9]) <= MOST_PERFORMERS):
        raise ValueError(f"expected a whole number from 1 to {MOST_PERFORMERS}")
    return int(text)
