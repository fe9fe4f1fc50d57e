"""The player: a recording as a stream, with the same methods as a live one.

The player's timeline is recorded time that always rises. Where playback starts again from the
front, jumps or pauses, recorded times are shifted so that the timeline goes on. A `FrameTiming`
gives how far the timeline has come, and the time of the host at a moment of the timeline.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from devices.skeleton import Skeleton, SkeletonFrame
from replay.false_start import without_false_start
from replay.playback import Playback
from replay.recording import Recording

LONE_FRAME_SECONDS = 1.0 / 30.0
MOST_SPEED_CHANGES = 256  # that are remembered for frames that became due before them


class FrameTiming(Protocol):
    """How fast a player's timeline goes by."""

    @property
    def speed(self) -> float:
        """Seconds of the timeline for each second of the clock."""
        ...

    @speed.setter
    def speed(self, speed: float) -> None: ...

    @property
    def frames_a_poll(self) -> float:
        """The most frames that one poll gives; infinite when the clock alone decides."""
        ...

    def playhead(self) -> float:
        """How far the timeline [s] has come by now; infinite when no clock holds it back."""
        ...

    def stamp(self, at: float) -> float:
        """The performer's time [s] of the moment `at` on the timeline."""
        ...

    def go_to(self, at: float) -> None:
        """Put the playhead at `at` on the timeline [s], now."""
        ...


@dataclass(frozen=True, slots=True)
class _Stretch:
    """A stretch of the timeline at one speed: it begins at `at` [s], at `clock` [s] of the host."""

    at: float
    clock: float
    speed: float


class RealTime:
    """The recorded timing, `speed` times as fast; stamps are on the host's clock.

    The timeline starts with the first poll, seek or snapshot.

    Args:
        speed: seconds of the timeline for each second of the clock; it may be set at any time.
        clock: host monotonic time [s].

    Raises:
        ValueError: the speed is not a finite number above 0.
    """

    frames_a_poll = math.inf

    def __init__(self, speed: float = 1.0, clock: Callable[[], float] = time.perf_counter) -> None:
        self._speed = _checked(speed)
        self._clock = clock
        self._stretches: deque[_Stretch] = deque(maxlen=MOST_SPEED_CHANGES)

    @property
    def speed(self) -> float:
        """Seconds of the timeline for each second of the clock."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._speed = _checked(speed)
        if self._stretches:
            now = self._clock()
            self._stretches.append(_Stretch(self._at(now), now, speed))

    def playhead(self) -> float:
        """Seconds of the clock since the start, each times the speed that it had."""
        now = self._clock()
        if not self._stretches:
            self._stretches.append(_Stretch(0.0, now, self._speed))
        return self._at(now)

    def stamp(self, at: float) -> float:
        """The clock's reading when the playhead is, or was, at `at`."""
        for stretch in reversed(self._stretches):
            if at >= stretch.at:
                break
        return stretch.clock + (at - stretch.at) / stretch.speed

    def go_to(self, at: float) -> None:
        """Put the playhead at `at` on the timeline [s], now."""
        self._stretches.clear()
        self._stretches.append(_Stretch(at, self._clock(), self._speed))

    def _at(self, now: float) -> float:
        newest = self._stretches[-1]
        return newest.at + (now - newest.clock) * newest.speed


class EveryFrame:
    """Each poll gives exactly the next frame, whatever the clock.

    Stamps are the timeline's own, arrival times are not known, and the speed has no effect.
    """

    frames_a_poll = 1.0

    def __init__(self) -> None:
        self._speed = 1.0

    @property
    def speed(self) -> float:
        """The speed that was set; nothing follows it."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._speed = _checked(speed)

    def playhead(self) -> float:
        """No clock holds it back."""
        return math.inf

    def stamp(self, at: float) -> float:
        """The timeline's own time."""
        return at

    def go_to(self, at: float) -> None:
        """Nothing to do: no clock runs."""


@dataclass(frozen=True, slots=True)
class PlayerState:
    """Where a player is.

    Attributes:
        next: number of the frame that comes next.
        shift: [s] from recorded time to the timeline.
        last: [s] the newest moment of the timeline that was given.
        position: [s] recorded time.
        at: [s] the playhead on the timeline.
    """

    next: int
    shift: float
    last: float
    position: float
    at: float


class Player:
    """Plays a recording as a `SkeletonStream`; `frame.time` never falls, except by `restore`.

    Args:
        recording: what to play.
        timing: `RealTime` or `EveryFrame`.
        loop: start again from the front after the last frame, one median frame time later; it may
            be set at any time, and after the last frame starts playback again at once.
    """

    def __init__(self, recording: Recording, timing: FrameTiming, *, loop: bool = False) -> None:
        self.recording = recording
        self._timing = timing
        self._loop = loop
        self._next = 0
        self._shift = 0.0  # timeline = recorded time + shift
        self._last = 0.0  # the newest moment of the timeline that was given
        self._position = float(recording.times[0])
        self._paused_at: float | None = None
        self._closed = False
        steps = np.diff(recording.times)
        steps = steps[steps > 0]
        self._step = float(np.median(steps)) if len(steps) else LONE_FRAME_SECONDS

    def leave_out_false_start(self) -> None:
        """Show the first frame that belongs to the rest in place of those before it."""
        self.recording = without_false_start(self.recording)

    @property
    def skeleton(self) -> Skeleton:
        """The recording's skeleton."""
        return self.recording.skeleton

    @property
    def playback(self) -> Playback:
        """The player itself."""
        return self

    @property
    def ended(self) -> bool:
        """True once the last frame was given and the player does not loop, or it is closed."""
        return self._closed or (self._at_end and not self._loop)

    @property
    def every_frame(self) -> bool:
        """Whether each poll gives exactly the next frame, however long the loop takes."""
        return math.isfinite(self._timing.frames_a_poll)

    @property
    def position(self) -> float:
        """Recorded time [s] of the newest frame given, or where the last seek went."""
        return self._position

    @property
    def duration(self) -> float:
        """Recorded time [s] of the last frame."""
        return float(self.recording.times[-1])

    @property
    def speed(self) -> float:
        """Recorded seconds for each second of the host; without effect where no clock runs."""
        return self._timing.speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._timing.speed = speed

    @property
    def loop(self) -> bool:
        """Whether playback starts again from the front after the last frame."""
        return self._loop

    @loop.setter
    def loop(self, loop: bool) -> None:
        if loop and self.ended:
            self.seek(0.0)
        self._loop = loop

    @property
    def paused(self) -> bool:
        """Whether playback stands still."""
        return self._paused_at is not None

    def poll(self) -> Sequence[SkeletonFrame]:
        """The frames that are due by the timing, oldest first; never more than one whole pass."""
        if self._closed or self.paused:
            return []
        playhead = self._timing.playhead()
        self._start_again()
        self._skip_whole_passes(playhead)
        frames: list[SkeletonFrame] = []
        limit = min(self._timing.frames_a_poll, len(self.recording))
        while not self.ended and len(frames) < limit:
            self._start_again()
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

    def snapshot(self) -> PlayerState:
        """Where playback is."""
        return PlayerState(self._next, self._shift, self._last, self._position, self._now())

    def restore(self, state: PlayerState) -> None:
        """Go back to where playback was; it is paused or not as it is now.

        The timeline goes back too. By `EveryFrame` all frames after it have the times that they
        had before, by `RealTime` times of the host, as far apart as before.
        """
        self._next, self._shift = state.next, state.shift
        self._last, self._position = state.last, state.position
        self._timing.go_to(state.at)
        self._paused_at = state.at if self.paused else None

    def close(self) -> None:
        """Give no more frames; may be called twice."""
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    @property
    def _at_end(self) -> bool:
        return self._next >= len(self.recording)

    def _now(self) -> float:
        """Where the timeline stands: while paused, still; without a clock, one step on."""
        if self._paused_at is not None:
            return self._paused_at
        playhead = self._timing.playhead()
        return playhead if math.isfinite(playhead) else self._last + self._step

    def _give(self, at: float, playhead: float) -> SkeletonFrame:
        frame = self.recording.frame(self._next)
        self._position = frame.time
        self._last = at
        self._next += 1
        came = self._timing.stamp(playhead) if math.isfinite(playhead) else math.nan
        return replace(frame, time=self._timing.stamp(at), arrival=came)

    def _start_again(self) -> None:
        """Where a loop has come to its end: go on from the front."""
        if self._loop and self._at_end:
            self._next = 0
            self._shift += self._pass_seconds

    @property
    def _pass_seconds(self) -> float:
        """From the first frame of one pass to the first of the next."""
        return self.recording.seconds + self._step

    def _skip_whole_passes(self, playhead: float) -> None:
        """A loop that was not polled for long drops the passes that nobody saw."""
        if not self._loop or not math.isfinite(playhead):
            return
        start = float(self.recording.times[0]) + self._shift
        missed = math.floor((playhead - start) / self._pass_seconds) - 1
        if missed > 0:
            self._shift += missed * self._pass_seconds


def _checked(speed: float) -> float:
    if not (math.isfinite(speed) and speed > 0.0):
        raise ValueError(f"Expected a finite `speed` above 0, got {speed}")
    return speed
