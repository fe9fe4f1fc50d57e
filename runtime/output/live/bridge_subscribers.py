"""The publishing end of a bridge, without sockets: its subscribers, and the messages for each.

A subscriber is registered by its first call. The reply is an answer, for its clock, and the
skeleton until the subscriber has confirmed it. So it does not matter whether the bridge or the
subscriber starts first, late, or again.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from devices.bridge.messages import (
    LATEST,
    LEAVING,
    Answer,
    Call,
    OtherVersion,
    decode,
    encode_announcement,
    encode_answer,
    encode_face,
    encode_sample,
)
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.output.live.bridge_queue import BridgeQueue, LatestQueue, LosslessQueue, Parcel

MOST_SUBSCRIBERS = 32
MOST_CREDIT = 1024  # frames on their way to a subscriber; whoever claims more gets no more
ANNOUNCED = 0.2  # [s] at least between two announcements to the same subscriber
QUIET = 2.0  # [s] of silence, of many beats, after which another may take a subscriber's place
SILENCE = {True: 10.0, False: 120.0}
"""Silence [s] after which a subscriber is dropped: one in latest mode, and one in lossless mode."""


@dataclass(slots=True)
class _Subscriber:
    """One subscriber: its connection, the times [s] of its last call and of the last announcement
    to it, its queue and credit."""

    route: bytes
    heard_at: float
    latest: bool
    queue: BridgeQueue
    credit: int = 0
    announced_at: float = -math.inf

    def gone(self, now: float) -> bool:
        return now - self.heard_at > SILENCE[self.latest]


class BridgeSubscribers:
    """All subscribers of one stream of frames.

    Args:
        skeleton: of every frame.
        clock: this machine's monotonic clock [s], which the frames' times use.

    Attributes:
        frames: frames published.
        sent: frames sent, to all subscribers together.
        refused: messages that were no calls, or calls beyond `MOST_SUBSCRIBERS`.
        other_version: the protocol version of the last subscriber with another one than ours.

    Raises:
        InputError: the skeleton is too large for a message.
    """

    def __init__(self, skeleton: Skeleton, clock: Callable[[], float]) -> None:
        self.frames = 0
        self.sent = 0
        self.refused = 0
        self.other_version: int | None = None
        self._clock = clock
        self._session = secrets.randbits(64) | 1  # never 0, which means no session
        self._announcement = encode_announcement(self._session, skeleton)
        self._subscribers: dict[int, _Subscriber] = {}
        self._lost = 0  # frames, of subscribers that have left

    @property
    def count(self) -> int:
        """Number of subscribers."""
        return len(self._subscribers)

    @property
    def lost(self) -> int:
        """Frames that lossless subscribers will not get."""
        return self._lost + sum(s.queue.dropped for s in self._subscribers.values() if not s.latest)

    @property
    def settled(self) -> bool:
        """Whether every lossless subscriber has every frame."""
        return all(subscriber.queue.empty for subscriber in self._subscribers.values())

    def publish(self, frame: SkeletonFrame) -> None:
        """Queue the newest frame for every subscriber."""
        self.frames += 1
        if self._subscribers:
            data, face = encode_sample(self._session, self.frames, frame), b""
            if frame.blends:
                face = encode_face(self._session, self.frames, frame.blends)
            parcel = Parcel(self.frames, frame.performer, data, face)
            for subscriber in self._subscribers.values():
                subscriber.queue.offer(parcel)

    def read(self, route: bytes, data: bytes) -> list[bytes]:
        """Read one message from one connection, and return the replies to it. Never raises."""
        heard_at = self._clock()
        match decode(data):
            case Call() as call:
                return self._call(route, call, heard_at)
            case OtherVersion(version):
                # The head of a message is the same in every version, so both ends can say so.
                self.other_version = version
                return [encode_answer(Answer(self._session, 0, 0.0, heard_at, heard_at))]
        self.refused += 1
        return []

    def due(self) -> Iterator[tuple[bytes, bytes]]:
        """Yield connection and bytes of each message to send now."""
        for subscriber in self._subscribers.values():
            while (parcel := subscriber.queue.draw(subscriber.credit)) is not None:
                self.sent += 1
                if parcel.face:
                    yield subscriber.route, parcel.face
                yield subscriber.route, parcel.data

    def forget(self) -> int:
        """Drop subscribers that have been silent for too long, and return their number."""
        now = self._clock()
        gone = [client for client, subscriber in self._subscribers.items() if subscriber.gone(now)]
        for client in gone:
            self._dismiss(client)
        return len(gone)

    def _dismiss(self, client: int) -> None:
        subscriber = self._subscribers.pop(client, None)
        if subscriber is not None and not subscriber.latest:
            self._lost += subscriber.queue.dropped

    def _call(self, route: bytes, call: Call, heard_at: float) -> list[bytes]:
        if call.mode == LEAVING:
            self._dismiss(call.client)
            return []
        subscriber = self._subscribers.get(call.client) or self._welcome(route, call, heard_at)
        if subscriber is None:
            self.refused += 1
            return []
        if subscriber.route != route:
            subscriber.route = route
            subscriber.queue.reconnect(call.received)
        subscriber.queue.received(call.received)
        subscriber.heard_at, subscriber.credit = heard_at, min(call.credit, MOST_CREDIT)
        answer = Answer(
            self._session,
            subscriber.queue.sent,
            call.called_at,
            heard_at,
            answered_at=self._clock(),
        )
        replies = [encode_answer(answer)]
        confirmed = call.session == self._session
        if not confirmed and heard_at - subscriber.announced_at >= ANNOUNCED:
            subscriber.announced_at = heard_at
            replies.append(self._announcement)
        return replies

    def _welcome(self, route: bytes, call: Call, heard_at: float) -> _Subscriber | None:
        """Give a place to a new subscriber; None where all are taken.

        A connection has one place: who invents numbers takes no other's. Where all are taken, the
        one that has been silent for longest gives way.
        """
        for client, other in list(self._subscribers.items()):
            if other.route == route:
                self._dismiss(client)
        if len(self._subscribers) >= MOST_SUBSCRIBERS:
            quietest = min(self._subscribers, key=lambda each: self._subscribers[each].heard_at)
            if heard_at - self._subscribers[quietest].heard_at < QUIET:
                return None
            self._dismiss(quietest)
        latest = call.mode == LATEST
        queue = LatestQueue(self.frames) if latest else LosslessQueue(self.frames)
        self._subscribers[call.client] = subscriber = _Subscriber(route, heard_at, latest, queue)
        return subscriber
