"""The bridge's side of a bridge, without sockets: which stages listen, and what goes to each.

A stage is there as soon as it calls. What is said back is an answer, for its clock, and the
skeleton until it has heard of it; so it does not matter who comes first, who comes late, or who
starts anew.
"""

from __future__ import annotations

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
    encode_sample,
)
from devices.skeleton import Skeleton, SkeletonFrame
from runtime.output.live.bridge_queue import BridgeQueue, LatestQueue, LosslessQueue, Parcel

MOST_STAGES = 32
GONE = {True: 10.0, False: 120.0}
"""After how long a silence [s] a stage is forgotten, one that takes the latest and one that must
get every frame."""


@dataclass(slots=True)
class _Stage:
    """Who listens: the connection it was last heard on and when [s], what it has room for."""

    route: bytes
    heard_at: float
    latest: bool
    queue: BridgeQueue
    credit: int = 0

    def gone(self, now: float) -> bool:
        return now - self.heard_at > GONE[self.latest]


class BridgeAudience:
    """Everybody who listens to one stream of frames.

    Args:
        skeleton: of every frame.
        clock: this machine's monotonic clock [s], that of the frames' times.

    Attributes:
        frames: frames published.
        sent: frames that went out, to all stages together.
        refused: messages that were no call, or of one stage too many.
        other_version: the version that some stage spoke last, if it was not ours.

    Raises:
        InputError: the skeleton is too large for a message.
    """

    def __init__(self, skeleton: Skeleton, clock: Callable[[], float]) -> None:
        self.frames = 0
        self.sent = 0
        self.refused = 0
        self.other_version: int | None = None
        self._clock = clock
        self._session = secrets.randbits(64) | 1  # never 0, which is no session
        self._announcement = encode_announcement(self._session, skeleton)
        self._stages: dict[int, _Stage] = {}
        self._lost = 0  # of stages that have gone

    @property
    def stages(self) -> int:
        """How many listen."""
        return len(self._stages)

    @property
    def lost(self) -> int:
        """Frames that stages which must get every one will not get."""
        return self._lost + sum(s.queue.dropped for s in self._stages.values() if not s.latest)

    @property
    def settled(self) -> bool:
        """Whether every stage that must get every frame has them all."""
        return all(stage.queue.empty for stage in self._stages.values())

    def publish(self, frame: SkeletonFrame) -> None:
        """Take in the newest frame, for everybody who listens."""
        self.frames += 1
        if self._stages:
            data = encode_sample(self._session, self.frames, frame)
            for stage in self._stages.values():
                stage.queue.offer(Parcel(self.frames, frame.performer, data))

    def hear(self, route: bytes, data: bytes) -> list[bytes]:
        """Take in one message from one connection; what to say back on it. Never raises."""
        heard_at = self._clock()
        match decode(data):
            case Call() as call:
                return self._call(route, call, heard_at)
            case OtherVersion(version):
                # The head of a message means the same in every version: that we cannot talk.
                self.other_version = version
                return [encode_answer(Answer(self._session, 0, 0.0, heard_at, heard_at))]
        self.refused += 1
        return []

    def due(self) -> Iterator[tuple[bytes, bytes]]:
        """Connection and bytes of each message that should go out now."""
        for stage in self._stages.values():
            while (parcel := stage.queue.draw(stage.credit)) is not None:
                self.sent += 1
                yield stage.route, parcel.data

    def forget(self) -> int:
        """Let go of stages that have been silent for long; how many those were."""
        now = self._clock()
        gone = [client for client, stage in self._stages.items() if stage.gone(now)]
        for client in gone:
            self._dismiss(client)
        return len(gone)

    def _dismiss(self, client: int) -> None:
        stage = self._stages.pop(client, None)
        if stage is not None and not stage.latest:
            self._lost += stage.queue.dropped

    def _call(self, route: bytes, call: Call, heard_at: float) -> list[bytes]:
        if call.mode == LEAVING:
            self._dismiss(call.client)
            return []
        stage = self._stages.get(call.client) or self._welcome(route, call, heard_at)
        if stage is None:
            self.refused += 1
            return []
        if stage.route != route:
            stage.route = route
            stage.queue.reconnect(call.received)
        stage.queue.received(call.received)
        stage.heard_at, stage.credit = heard_at, call.credit
        answer = Answer(
            self._session, stage.queue.sent, call.called_at, heard_at, answered_at=self._clock()
        )
        told = call.session == self._session
        return [encode_answer(answer), *([] if told else [self._announcement])]

    def _welcome(self, route: bytes, call: Call, heard_at: float) -> _Stage | None:
        if len(self._stages) >= MOST_STAGES:
            return None
        latest = call.mode == LATEST
        queue = LatestQueue(self.frames) if latest else LosslessQueue(self.frames)
        self._stages[call.client] = stage = _Stage(route, heard_at, latest, queue)
        return stage
