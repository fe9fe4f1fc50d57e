"""The stage's side of a bridge, without sockets: what comes in becomes frames, what to say is told.

A stage calls until it is answered, and goes on calling: a call is at once the greeting, the sign of
life, the question for the other clock, and the word of how far it has come, which lets the bridge
send more. A bridge that starts anew has a new session; its skeleton comes again, and its numbers
start from its first frame.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence

import numpy as np

from devices.bridge.clock_offset import ClockOffset
from devices.bridge.messages import (
    LATEST,
    LEAVING,
    LOSSLESS,
    MAX_CREDIT,
    Announcement,
    Answer,
    Call,
    OtherVersion,
    Sample,
    decode,
    encode_call,
)
from devices.bridge.sanitize import make_safe
from devices.skeleton import Skeleton, SkeletonFrame

BEAT = 0.25  # [s] between calls when there is nothing else to say
CREDIT = {LATEST: 16, LOSSLESS: 1024}
"""How many frames may be under way at once: few where only the newest count, so that a slow
network holds no old ones."""

CORRECTION = 0.1  # [s] by which a better knowledge of the other clock may set a time back
PERFORMERS = 256  # remembered at once


class BridgeReceiver:
    """A decoder of what a bridge says, which also knows what to say to it.

    Args:
        mode: `LATEST` or `LOSSLESS`.

    Attributes:
        skeleton: of every frame; None before the first announcement. It stays for good.
        session: the run of the bridge that frames are taken from; 0 before any.
        other_version: the version that the other side spoke last, if it was not ours.
        strange: whether the bridge now sends another skeleton than at first, which is refused.
        refused: messages that were no whole message, or that do not belong here.
        lost: frames of this bridge that did not come; where the latest win, those left out there.
        heard_at: our clock [s] at the last answer; minus infinity before any.
        clock: how far the bridge's clock is from ours.
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
        self._came = 0  # the highest sequence number that came
        self._told = 0  # the highest that the bridge was last told it may send
        self._called_at = float("-inf")
        self._last: dict[int, float] = {}  # each performer's newest time [s]
        make_safe(np.zeros((1, 3)), np.zeros(1), np.zeros((1, 4)))  # compiled before a frame comes

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        """The frame in one message, on our clock; nothing for any other message. Never raises.

        Args:
            data: one message.
            arrival: our clock [s] when it came; becomes the frame's.
        """
        match decode(data):
            case Sample() as sample:
                return self._sample(sample, arrival)
            case Answer() as answer:
                self._answer(answer, arrival)
            case Announcement() as announcement:
                self._announcement(announcement)
            case OtherVersion(version):
                self.other_version = version
            case _:
                self.refused += 1
        return []

    def call_due(self, now: float, waiting: int = 0) -> bool:
        """Whether the bridge should hear from us: a beat has passed, or it may soon run dry.

        Args:
            now: our clock [s].
            waiting: frames that came and wait to be taken; so many fewer are asked for, so that a
                stage that stands still holds the bridge back.
        """
        more = self._came + self._credit(waiting) - self._told
        return now - self._called_at >= BEAT or more >= CREDIT[self._mode] // 4

    def call(self, now: float, waiting: int = 0) -> bytes:
        """What to say to the bridge at this time [s]; `waiting` as for `call_due`."""
        credit = self._credit(waiting)
        self._called_at = now
        self._told = self._came + credit
        return encode_call(Call(self._client, self._announced, self._came, now, credit, self._mode))

    def farewell(self, now: float) -> bytes:
        """The last word, so that the bridge keeps nothing for us."""
        return encode_call(Call(self._client, self._announced, self._came, now, 0, LEAVING))

    def _credit(self, waiting: int) -> int:
        return max(CREDIT[self._mode] - waiting, 0)

    def _answer(self, answer: Answer, arrival: float) -> None:
        if answer.session != self.session:
            self.session = answer.session
            self.clock = ClockOffset()
            self._came = answer.sent
            self._told = 0
        # Nothing overtakes: what was sent before this has come. A number far ahead was false.
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
        welcome = sample.session == self.session == self._announced and self.clock.known
        if not welcome or self.strange or not self._fits(sample):
            self.refused += 1
            return []
        if sample.sequence <= self._came:  # sent again after a break, though it had come before it
            return []
        self.lost += sample.sequence - self._came - 1
        self._came = sample.sequence
        time = min(sample.time - self.clock.seconds, arrival)
        return [sample.frame(self._rising(sample.performer, time), arrival)]

    def _fits(self, sample: Sample) -> bool:
        return self.skeleton is not None and len(sample.positions) == len(self.skeleton.names)

    def _rising(self, performer: int, time: float) -> float:
        """The time, but for what a better knowledge of the other clock takes back."""
        last = self._last.get(performer, time)
        if 0.0 < last - time <= CORRECTION:
            time = last
        if len(self._last) >= PERFORMERS:
            self._last.clear()
        self._last[performer] = time
        return time


def _alike(one: Skeleton, other: Skeleton) -> bool:
    return one.names == other.names and np.array_equal(one.parents, other.parents)
