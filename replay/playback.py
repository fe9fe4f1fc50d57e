"""The controls of a playing recording: position, speed, pause, loop; live streams have none."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from devices.stream import SkeletonStream
from replay.recording import Recording


class Playback(Protocol):
    """Playback of a recording; every method may be called between any two frames.

    Attributes:
        loop: whether playback starts again from the front after the last frame.
    """

    loop: bool

    @property
    def position(self) -> float:
        """Recorded time [s] of the newest frame, or of the last seek; in [0, `duration`]."""
        ...

    @property
    def duration(self) -> float:
        """Recorded time [s] of the last frame."""
        ...

    @property
    def speed(self) -> float:
        """Recorded seconds for each second of the host; without effect where no clock runs."""
        ...

    @speed.setter
    def speed(self, speed: float) -> None:
        """Play at `speed` from now on.

        Raises:
            ValueError: it is not a finite number above 0.
        """
        ...

    @property
    def paused(self) -> bool:
        """Whether playback stands still."""
        ...

    def seek(self, seconds: float) -> None:
        """Go on from the first frame at or after `seconds` of recorded time (kept within it).

        Raises:
            ValueError: `seconds` is not a number.
        """
        ...

    def pause(self) -> None:
        """Stand still until `resume`."""
        ...

    def resume(self) -> None:
        """Go on from where `pause` stood; the time between is not caught up."""
        ...


@runtime_checkable
class Played(Protocol):
    """A stream that may be played back, or that hands on one that may."""

    @property
    def playback(self) -> Playback | None:
        """Its playback; None where the frames are live."""
        ...


@runtime_checkable
class OfRecording(Playback, Protocol):
    """A playback of a recording that is known from the first frame to the last.

    Attributes:
        recording: all of its frames.
    """

    recording: Recording

    def leave_out_false_start(self) -> None:
        """Show the first frame that belongs to the rest in place of those before it."""
        ...


def playback_of(stream: SkeletonStream) -> Playback | None:
    """Return the playback of a recorded stream, however it is wrapped; None for a live one."""
    return stream.playback if isinstance(stream, Played) else None


def recording_of(stream: SkeletonStream) -> Recording | None:
    """Return the recording that a stream plays; None where nobody knows what comes."""
    playback = playback_of(stream)
    return playback.recording if isinstance(playback, OfRecording) else None
