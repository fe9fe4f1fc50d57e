"""A live device as a stream: a transport on a reader thread, decoders per sender, and an inbox."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable, Sequence
from typing import Protocol, Self

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.inbox import CAPACITY, Inbox
from devices.transport.senders import Decoder, Senders
from devices.transport.traffic import Rhythm, Traffic

Deliver = Callable[[bytes, float, Hashable], None]
"""Takes one message, its arrival on the host's monotonic clock [s], and its sender ("" if only
one)."""

PATIENCE = 2.0  # [s] that closing waits for the reader thread


class Transport(Protocol):
    """A source of messages: a socket, a library's queue, an SDK."""

    @property
    def dropped(self) -> int:
        """Messages that this machine lost before they were read, as far as known."""
        ...

    @property
    def trouble(self) -> str:
        """One line that describes a current fault of the connection, or an empty one."""
        ...

    def run(self, deliver: Deliver) -> None:
        """Deliver messages on the reader thread until it is closed.

        Raises:
            InputError: no message can come any more.
        """
        ...

    def close(self) -> None:
        """Make `run` return soon and release resources; may be called twice."""
        ...


class LiveStream:
    """A `SkeletonStream` over a transport; one thread receives, stamps, decodes and queues.

    Args:
        transport: already open.
        make_decoder: makes the decoder of each sender.
        capacity: largest number of frames that wait for a poll.
    """

    def __init__(
        self,
        transport: Transport,
        make_decoder: Callable[[], Decoder],
        *,
        capacity: int = CAPACITY,
    ) -> None:
        self.transport = transport
        self._senders = Senders(make_decoder)
        self._inbox = Inbox(capacity)
        self._listeners: tuple[Callable[[SkeletonFrame], None], ...] = ()
        self._rhythm = Rhythm()
        self._packets = self._frames = self._failed = 0
        self._last_seen = float("nan")
        self._trouble = ""
        self._closed = False
        self._thread = threading.Thread(target=self._receive, name="device", daemon=True)
        self._thread.start()

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of every frame."""
        return self._senders.skeleton

    @property
    def ended(self) -> bool:
        """True only once it is closed."""
        return self._closed

    @property
    def traffic(self) -> Traffic:
        """Counters of the received data."""
        rate, jitter = self._rhythm.measure(time.perf_counter())
        return Traffic(
            packets=self._packets,
            frames=self._frames,
            refused=self._senders.refused + self._failed,
            dropped=self._inbox.dropped + self.transport.dropped,
            rate=rate,
            jitter=jitter,
            last_seen=self._last_seen,
            trouble=self._trouble or self.transport.trouble,
        )

    def tap(self, listener: Callable[[SkeletonFrame], None]) -> None:
        """Pass every frame from now on to `listener`, in order, on the reader thread.

        A recorder listens here, before the inbox, which drops frames if the frame loop is slow. The
        listener must not wait or raise.
        """
        self._listeners = (*self._listeners, listener)

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` for a frame; return whether there is one."""
        return self._inbox.wait(seconds)

    def poll(self) -> Sequence[SkeletonFrame]:
        """Return the frames since the last poll, oldest first; never blocks."""
        return [] if self._closed else self._inbox.take()

    def close(self) -> None:
        """Stop receiving; may be called twice."""
        if not self._closed:
            self._closed = True
            self.transport.close()
            self._thread.join(PATIENCE)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _receive(self) -> None:
        try:
            self.transport.run(self._deliver)
        except InputError as error:
            self._trouble = str(error)
        except OSError as error:
            self._trouble = f"the connection is lost ({error}); open the device again"

    def _deliver(self, data: bytes, arrival: float, source: Hashable) -> None:
        self._packets += 1
        self._last_seen = arrival
        try:
            frames = self._senders.feed(data, arrival, source)
        except Exception as error:  # a defect in a decoder must not end the show
            self._failed += 1
            self._trouble = f"a message could not be decoded ({error!r}); please report this"
            return
        for frame in frames:
            self._rhythm.note(frame.arrival, frame.performer)
            for listener in self._listeners:
                listener(frame)
        self._frames += len(frames)
        self._inbox.put(frames)
