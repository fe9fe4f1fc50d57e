"""The player: a recording as a stream that no loop can tell from a live one.

Its timeline is the recorded time made to rise for ever: where playback starts again from the front,
jumps, or pauses, the recorded times are shifted so that the timeline goes on. A pace says how far
the timeline has come, and what time of the host a moment on it is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol, Self

import numpy as np

from devices.skeleton import Skeleton, SkeletonFrame
from replay.recording import Recording

LONE_FRAME_SECONDS = 1.0 / 30.0


class FrameTiming(Protocol):
    """How fast a player's timeline goes by."""

    @property
    def frames_a_poll(self) -> float:
        """The most frames that one poll gives; infinite when the clock alone decides."""
        ...

    def playhead(self) -> float:
        """How far the timeline [s] has come by now; infinite when no clock holds it back."""
        ...

    def stamp(self, at: float) -> float:
        """The performer's time [s] of what lies at `at` on the timeline."""
        ...


class RealTime:
    """The recorded timing, `speed` times as fast; stamps are on the host's clock.

    The timeline starts with the first poll.

    Raises:
        ValueError: the speed is not a finite number above 0.
    """

    frames_a_poll = math.inf

    def __init__(self, speed: float = 1.0, clock: Callable[[], float] = time.perf_counter) -> None:
        if not (math.isfinite(speed) and speed > 0):
            raise ValueError(f"Expected a finite `speed` above 0, got {speed}")
        self.speed = speed
        self._clock = clock
        self._start: float | None = None

    def playhead(self) -> float:
        """Seconds of the clock since the first poll, times the speed."""
        now = self._clock()
        if self._start is None:
            self._start = now
        return (now - self._start) * self.speed

    def stamp(self, at: float) -> float:
        """The clock's reading when the playhead is at `at`."""
        return (self._start or 0.0) + at / self.speed


class EveryFrame:
    """Each poll gives exactly the next frame, whatever the clock.

    Stamps are the timeline's own, and nobody knows when frames arrive.
    """

    frames_a_poll = 1.0

    def playhead(self) -> float:
        """No clock holds it back."""
        return math.inf

    def stamp(self, at: float) -> float:
        """The timeline's own time."""
        return at


class Player:
    """Plays a recording as a `SkeletonStream`; `frame.time` never falls, whatever is done to it.

    Args:
        recording: what to play.
        pace: `RealTime` or `EveryFrame`.
        loop: start again from the front after the last frame, one median frame time later.
    """

    def __init__(self, recording: Recording, pace: FrameTiming, *, loop: bool = False) -> None:
        self.recording = recording
        self.loop = loop
        self._pace = pace
        self._next = 0
        self._shift = 0.0  # timeline = recorded time + shift
        self._last = 0.0  # the newest moment of the timeline that was given
        self._position = float(recording.times[0])
        self._paused_at: float | None = None
        self._closed = False
        steps = np.diff(recording.times)
        steps = steps[steps > 0]
        self._step = float(np.median(steps)) if len(steps) else LONE_FRAME_SECONDS

    @property
    def skeleton(self) -> Skeleton:
        """The recording's skeleton."""
        return self.recording.skeleton

    @property
    def ended(self) -> bool:
        """True once the last frame was given and the player does not loop, or it is closed."""
        return self._closed or self._next >= len(self.recording)

    @property
    def position(self) -> float:
        """Recorded time [s] of the newest frame given, or where the last seek went."""
        return self._position

    @property
    def paused(self) -> bool:
        """Whether playback stands still."""
        return self._paused_at is not None

    def poll(self) -> Sequence[SkeletonFrame]:
        """The frames that are due by the pace, oldest first; never more than one whole pass."""
        if self._closed or self.paused:
            return []
        playhead = self._pace.playhead()
        self._skip_whole_passes(playhead)
        frames: list[SkeletonFrame] = []
        limit = min(self._pace.frames_a_poll, len(self.recording))
        while not self.ended and len(frames) < limit:
            at = float(self.recording.times[self._next]) + self._shift
            if at > playhead:
                break
            frames.append(self._give(at, playhead))
        return frames

    def seek(self, seconds: float) -> None:
        """Go on from the first frame at or after `seconds` of recorded time (kept within it).

        Raises:
            ValueError: `seconds` is not a number.
        """
        if math.isnan(seconds):
            raise ValueError("Expected `seconds` to be a number, got nan")
        times = self.recording.times
        target = min(max(seconds, float(times[0])), float(times[-1]))
        self._next = int(np.searchsorted(times, target, side="left"))
        self._shift = self._now() - target
        self._position = target

    def pause(self) -> None:
        """Stand still until `resume`."""
        if not self.paused:
            self._paused_at = self._now()

    def resume(self) -> None:
        """Go on from where `pause` stood; the time between is not caught up."""
        if self._paused_at is not None:
            started, self._paused_at = self._paused_at, None
            self._shift += self._now() - started

    def close(self) -> None:
        """Give no more frames; may be called twice."""
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _now(self) -> float:
        """Where the timeline stands: while paused, still; without a clock, one step on."""
        if self._paused_at is not None:
            return self._paused_at
        playhead = self._pace.playhead()
        return playhead if math.isfinite(playhead) else self._last + self._step

    def _give(self, at: float, playhead: float) -> SkeletonFrame:
        frame = self.recording.frame(self._next)
        self._position = frame.time
        self._last = at
        self._next += 1
        if self.loop and self._next == len(self.recording):
            self._next = 0
            self._shift += self._pass_seconds
        came = self._pace.stamp(playhead) if math.isfinite(playhead) else math.nan
        return replace(frame, time=self._pace.stamp(at), arrival=came)

    @property
    def _pass_seconds(self) -> float:
        """From the first frame of one pass to the first of the next."""
        return self.recording.seconds + self._step

    def _skip_whole_passes(self, playhead: float) -> None:
        """A loop that was not polled for long drops the passes that nobody saw."""
        if not self.loop or not math.isfinite(playhead):
            return
        start = float(self.recording.times[0]) + self._shift
        missed = math.floor((playhead - start) / self._pass_seconds) - 1
        if missed > 0:
            self._shift += missed * self._pass_seconds
