"""The protocol of a subscriber without sockets: decodes messages to frames, composes requests.

A subscriber sends calls until it is answered, and continues. A call is the greeting, the heartbeat,
the clock request and the acknowledgement that gives the publisher new credit. A restarted publisher
has a new session: its skeleton is sent again, and its sequence numbers start from 1.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence

import numpy as np

from devices.blend_shapes import Blends
from devices.bridge.clock_offset import ClockOffset
from devices.bridge.messages import (
    LATEST,
    LEAVING,
    LOSSLESS,
    MAX_CREDIT,
    Announcement,
    Answer,
    Call,
    FaceWeights,
    OtherVersion,
    Sample,
    decode,
    encode_call,
)
from devices.bridge.sanitize import make_safe
from devices.skeleton import Skeleton, SkeletonFrame

BEAT = 0.25  # [s] between calls when there is nothing else to report
CREDIT = {LATEST: 16, LOSSLESS: 1024}
"""Credit: frames that may be in transit at once. It is small where only the newest frame counts, so
that a slow network does not buffer old ones."""

CORRECTION = 0.1  # [s] by which a better clock offset may move a frame's time back
PERFORMERS = 256  # performers whose newest time is remembered


class BridgeReceiver:
    """Decodes the publisher's messages and composes the calls to it.

    Args:
        mode: `LATEST` or `LOSSLESS`.

    Attributes:
        skeleton: of every frame; None before the first announcement, then constant.
        session: the publisher's session that frames are accepted from; 0 before any.
        other_version: the other side's version in its last message, if it differs from ours.
        strange: whether the publisher now sends a different skeleton; its frames are refused.
        refused: messages that were malformed or out of place.
        lost: frames of this session that did not arrive, or were skipped by the publisher.
        heard_at: our clock [s] at the last answer; minus infinity before any.
        clock: offset of the publisher's clock.
    """

    def __init__(self, mode: int) -> None:
        self.skeleton: Skeleton | None = None
        self.session = 0
        self.other_version: int | None = None
        self.strange = False
        self.refused = 0
        self.lost = 0
        self.heard_at = float("-inf")
        self.clock = ClockOffset()
        self._mode = mode
        self._client = secrets.randbits(64)
        self._announced = 0  # the session whose skeleton is known
        self._came = 0  # the highest sequence number received
        self._granted = 0  # the highest sequence number that the publisher may send
        self._called_at = float("-inf")
        self._face: FaceWeights | None = None  # of the sample that comes next
        self._last: dict[int, float] = {}  # each performer's newest time [s]
        make_safe(np.zeros((1, 3)), np.zeros(1), np.zeros((1, 4)))  # compile before the first frame

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """Return the frame in one message, on our clock; nothing for other messages. Never raises.

        Args:
            data: one message.
            arrival: our clock [s] at its receipt; becomes the frame's arrival.
        """
        match decode(data):
            case Sample() as sample:
                return self._sample(sample, arrival)
            case Answer() as answer:
                self._answer(answer, arrival)
            case Announcement() as announcement:
                self._announcement(announcement)
            case FaceWeights() as face:
                self._face = face
            case OtherVersion(version):
                self.other_version = version
            case _:
                self.refused += 1
        return []

    def call_due(self, now: float, waiting: int = 0) -> bool:
        """Whether a call should be sent: a beat has passed, or the publisher may run out of credit.

        Args:
            now: our clock [s].
            waiting: received frames that are not taken yet. They reduce the credit, so a paused
                frame loop pauses the publisher.
        """
        more = self._came + self._credit(waiting) - self._granted
        return now - self._called_at >= BEAT or more >= CREDIT[self._mode] // 4

    def call(self, now: float, waiting: int = 0) -> bytes:
        """Return the call to send at this time [s]; `waiting` as for `call_due`."""
        credit = self._credit(waiting)
        self._called_at = now
        self._granted = self._came + credit
        return encode_call(Call(self._client, self._announced, self._came, now, credit, self._mode))

    def farewell(self, now: float) -> bytes:
        """Return the last message, after which the publisher keeps nothing for us."""
        return encode_call(Call(self._client, self._announced, self._came, now, 0, LEAVING))

    def _credit(self, waiting: int) -> int:
        return max(CREDIT[self._mode] - waiting, 0)

    def _answer(self, answer: Answer, arrival: float) -> None:
        if answer.session != self.session:
            self.session = answer.session
            self.clock = ClockOffset()
            self._came = answer.sent
            self._granted = 0
        # Messages arrive in order: frames sent before this answer have arrived or are lost.
        elif answer.sent > self._came:
            self.lost += answer.sent - self._came
            self._came = answer.sent
        elif self._came - answer.sent > MAX_CREDIT:
            self._came = answer.sent
        if self.clock.add(answer.called_at, answer.heard_at, answer.answered_at, arrival):
            self.heard_at = arrival
            self.other_version = None
        else:
            self.refused += 1

    def _announcement(self, announcement: Announcement) -> None:
        if announcement.session != self.session:
            self.refused += 1
            return
        self._announced = self.session
        if self.skeleton is None:
            self.skeleton = announcement.skeleton
        self.strange = not _alike(self.skeleton, announcement.skeleton)

    def _sample(self, sample: Sample, arrival: float) -> Sequence[SkeletonFrame]:
        accepted = sample.session == self.session == self._announced and self.clock.known
        if not accepted or self.strange or not self._fits(sample):
            self.refused += 1
            return []
        if sample.sequence <= self._came:  # sent again after a reconnect, received before it
            return []
        self.lost += sample.sequence - self._came - 1
        self._came = sample.sequence
        time = min(sample.time - self.clock.seconds, arrival)
        return [sample.frame(self._rising(sample.performer, time), arrival, self._face_of(sample))]

    def _face_of(self, sample: Sample) -> Blends | None:
        face = self._face
        if face is None or (face.session, face.sequence) != (sample.session, sample.sequence):
            return None
        return face.blends

    def _fits(self, sample: Sample) -> bool:
        return self.skeleton is not None and len(sample.positions) == len(self.skeleton.names)

    def _rising(self, performer: int, time: float) -> float:
        """`time` [s], kept from falling where the estimate of the other clock improves."""
        last = self._last.get(performer, time)
        if 0.0 < last - time <= CORRECTION:
            time = last
        if len(self._last) >= PERFORMERS:
            self._last.clear()
        self._last[performer] = time
        return time


def _alike(one: Skeleton, other: Skeleton) -> bool:
    return one.names == other.names and np.array_equal(one.parents, other.parents)
