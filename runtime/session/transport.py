"""The transport of a session: the present moment, and whether the time runs, stands or loops."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum

LONGEST_STEP = 0.25  # [s] that a frame counts for at most


class Mode(Enum):
    """Whether the time of a session stands, plays or records."""

    REHEARSING = "rehearsing"  # it stands still; performers move their characters
    PLAYING = "playing"
    PAUSED = "paused"  # it stands still, at a moment that is shown
    RECORDING = "recording"


class Transport:
    """Keeps the position of a session; a `Playback` like that of a recording.

    The position follows the times of the frames that the show performs, so that a show that
    performs every frame plays the same whatever the clock says.

    Args:
        length: gives the duration of the session [s] as it is now.

    Attributes:
        loop: whether playing starts again from the front at the end.
        mode: what the time does.
    """

    def __init__(self, length: Callable[[], float]) -> None:
        self.loop = False
        self.mode = Mode.REHEARSING
        self._length = length
        self._position = 0.0
        self._speed = 1.0
        self._at = math.nan

    @property
    def position(self) -> float:
        """[s] of the session's time."""
        return self._position

    @property
    def duration(self) -> float:
        """[s] until the last clip ends; while recording, at least until now."""
        return max(self._length(), self._position if self.mode is Mode.RECORDING else 0.0)

    @property
    def speed(self) -> float:
        """Seconds of the session for each second of the show."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        """Go on at `speed`.

        Raises:
            ValueError: it is not a finite number above 0.
        """
        if not (math.isfinite(speed) and speed > 0.0):
            raise ValueError(f"Expected a finite `speed` above 0, got {speed}")
        self._speed = speed

    @property
    def paused(self) -> bool:
        """Whether the time stands still."""
        return not self.moving

    @property
    def moving(self) -> bool:
        """Whether the time runs."""
        return self.mode in (Mode.PLAYING, Mode.RECORDING)

    def seek(self, seconds: float) -> None:
        """Go to a moment [s]; before 0 to 0. It is shown, unless the session plays.

        While it records, nothing happens.

        Raises:
            ValueError: `seconds` is not a number.
        """
        if math.isnan(seconds):
            raise ValueError("Expected `seconds` to be a number, got nan")
        if self.mode is Mode.RECORDING:
            return
        self.go_to(seconds)
        if self.mode is Mode.REHEARSING:
            self.mode = Mode.PAUSED

    def go_to(self, seconds: float) -> None:
        """Go to a moment [s], in any mode; before 0 to 0."""
        self._position = max(seconds, 0.0)

    def pause(self) -> None:
        """Stand still at the moment that is shown."""
        self.mode = Mode.PAUSED

    def resume(self) -> None:
        """Play on; at the end, from the start."""
        if self._position >= self._length() and not self.loop:
            self._position = 0.0
        self.mode = Mode.PLAYING

    def rehearse(self) -> None:
        """Stand still and let performers move their characters."""
        self.mode = Mode.REHEARSING

    def record(self) -> None:
        """Go on from here, while performers move their characters."""
        self.mode = Mode.RECORDING

    def advance(self, now: float) -> float:
        """Go on to a frame of the show at `now` [s]; return the position.

        Playing stands still at the end, or starts again.
        """
        passed, self._at = now - self._at, now
        if not self.moving or math.isnan(passed):
            return self._position
        self._position += self._speed * min(max(passed, 0.0), LONGEST_STEP)
        end = self._length()
        if self.mode is Mode.PLAYING and self._position >= end:
            if self.loop and end > 0.0:
                self._position = math.fmod(self._position, end)
            else:
                self._position, self.mode = end, Mode.PAUSED
        return self._position
