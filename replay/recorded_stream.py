"""A stream that passes every frame to a recorder on arrival, even if it is polled rarely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, Self, runtime_checkable

from devices.skeleton import Skeleton, SkeletonFrame
from devices.stream import SkeletonStream
from replay.playback import Playback, playback_of

Keep = Callable[[SkeletonFrame], None]


@runtime_checkable
class Tapped(Protocol):
    """A stream with its own thread that can pass on each frame on arrival."""

    def tap(self, listener: Keep) -> None:
        """Call `listener` with every frame from now on, in order, on the receiving thread."""
        ...


class RecordedStream:
    """Passes on the frames of `stream`, each first to `keep`, in order and exactly once.

    Frames of a live device are taken on its own thread, before they wait for the frame loop, so a
    loop that pauses or drops frames does not affect the recording. A stream that has frames only
    when it is polled, such as a player, is recorded as it is polled.

    Args:
        stream: is closed with this one.
        keep: takes a frame; it must not raise nor, for a live device, wait. It may be exchanged at
            any time; None keeps nothing.
    """

    def __init__(self, stream: SkeletonStream, keep: Keep | None = None) -> None:
        self.keep = keep
        self.newest: SkeletonFrame | None = None
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
        """True once no further frame can come."""
        return self._stream.ended

    @property
    def playback(self) -> Playback | None:
        """The playback of the stream; None where that is live."""
        return playback_of(self._stream)

    def poll(self) -> Sequence[SkeletonFrame]:
        """Return every frame since the last poll, oldest first."""
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
        keep, self.newest = self.keep, frame
        if keep is not None:
            keep(frame)
