"""A stream whose frames are recorded as they arrive, however seldom it is polled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, Self, runtime_checkable

from devices.skeleton import Skeleton, SkeletonFrame
from devices.stream import SkeletonStream
from replay.playback import Playback, playback_of

Keep = Callable[[SkeletonFrame], None]


@runtime_checkable
class Tapped(Protocol):
    """A stream with a thread of its own that can show each frame the moment it comes."""

    def tap(self, listener: Keep) -> None:
        """Call `listener` with every frame from now on, in order, on the thread it comes on."""
        ...


class RecordedStream:
    """Gives the frames of `stream` on, and each to `keep` first, in order and exactly once.

    From a live device they are taken on its own thread, before they wait for the frame loop, so
    that a loop that stands still or drops frames costs the recording none. A stream that only has
    frames when it is polled, such as a player, is recorded as it is polled.

    Args:
        stream: is closed with this one.
        keep: takes a frame and neither raises nor, for a live device, waits; may be exchanged at
            any time, None keeps nothing.
    """

    def __init__(self, stream: SkeletonStream, keep: Keep | None = None) -> None:
        self.keep = keep
        self._stream = stream
        self._tapped = isinstance(stream, Tapped)
        if isinstance(stream, Tapped):
            stream.tap(self._take)

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of every frame."""
        return self._stream.skeleton

    @property
    def ended(self) -> bool:
        """True once no frame can come any more."""
        return self._stream.ended

    @property
    def playback(self) -> Playback | None:
        """The playback of the stream; None where that is live."""
        return playback_of(self._stream)

    def poll(self) -> Sequence[SkeletonFrame]:
        """Every frame that has come since the last poll, oldest first."""
        frames = self._stream.poll()
        if not self._tapped:
            for frame in frames:
                self._take(frame)
        return frames

    def close(self) -> None:
        """Close the stream; may be called twice."""
        self._stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _take(self, frame: SkeletonFrame) -> None:
        keep = self.keep
        if keep is not None:
            keep(frame)
