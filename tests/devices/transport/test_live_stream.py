"""A live stream: every frame once and in order, bounded, told apart by sender, hard to kill."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
import pytest

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.inbox import Inbox
from devices.transport.live_stream import Deliver, LiveStream
from devices.transport.senders import MOST_SENDERS, Senders
from devices.transport.traffic import Rhythm
from tests.waiting import PATIENCE

POINT = Skeleton(("point",), np.array([-1]), np.zeros((1, 3)))


def numbered(number: float, arrival: float = 0.0, performer: int = 0) -> SkeletonFrame:
    place = np.array([[number, 0.0, 0.0]])
    return SkeletonFrame(arrival, place, None, np.ones(1), performer, arrival)


class Numbers:
    """Decodes decimal numbers, and stumbles over the word "bug"."""

    skeleton = POINT

    def __init__(self) -> None:
        self.refused = 0

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        if data == b"bug":
            raise RuntimeError("a mistake in the decoder")
        if not data.isdigit():
            self.refused += 1
            return ()
        return [numbered(float(data), arrival)]


class Script:
    """A transport that delivers what it is given, then waits or fails."""

    dropped = 3
    trouble = ""

    def __init__(self, messages: Sequence[bytes], failure: Exception | None = None) -> None:
        self._messages = messages
        self._failure = failure
        self._closing = threading.Event()
        self.delivered = threading.Event()

    def run(self, deliver: Deliver) -> None:
        for number, message in enumerate(self._messages):
            deliver(message, 100.0 + number / 60, "")
        self.delivered.set()
        if self._failure is not None:
            raise self._failure
        self._closing.wait(PATIENCE)

    def close(self) -> None:
        self._closing.set()


def places(frames: Sequence[SkeletonFrame]) -> list[float]:
    return [float(frame.positions[0, 0]) for frame in frames]


def test_every_frame_comes_once_and_what_is_bad_is_counted() -> None:
    script = Script([b"1", b"two", b"2", b"bug", b"3"])
    with LiveStream(script, Numbers) as stream:
        assert script.delivered.wait(PATIENCE)
        assert places(stream.poll()) == [1.0, 2.0, 3.0]
        assert list(stream.poll()) == []
        traffic = stream.traffic
        assert (traffic.packets, traffic.frames, traffic.refused) == (5, 3, 2)
        assert traffic.dropped == 3
        assert "a mistake in the decoder" in traffic.trouble
        assert traffic.last_seen == pytest.approx(100.0 + 4 / 60)
        assert not stream.ended
    assert stream.ended
    assert list(stream.poll()) == []
    stream.close()


def test_if_nobody_polls_the_oldest_are_dropped_and_counted() -> None:
    script = Script([str(number).encode() for number in range(100)])
    with LiveStream(script, Numbers, capacity=10) as stream:
        assert script.delivered.wait(PATIENCE)
        assert places(stream.poll()) == list(range(90, 100))
        assert stream.traffic.dropped == 90 + 3
    inbox = Inbox(2)
    inbox.put(numbered(n) for n in range(3))
    assert (places(inbox.take()), inbox.dropped, inbox.take()) == ([1.0, 2.0], 1, [])


@pytest.mark.parametrize("failure", [InputError("the sensor is gone"), OSError(5, "lost")])
def test_a_transport_that_fails_is_trouble_and_not_the_end_of_the_show(failure: Exception) -> None:
    script = Script([b"1"], failure)
    stream = LiveStream(script, Numbers)
    stream._thread.join(PATIENCE)
    assert places(stream.poll()) == [1.0]
    assert "gone" in stream.traffic.trouble or "lost" in stream.traffic.trouble
    assert not stream.ended
    stream.close()


def test_rate_and_jitter_are_those_of_the_last_seconds() -> None:
    rhythm = Rhythm()
    assert rhythm.measure(0.0) == (0.0, 0.0)
    for number in range(240):
        rhythm.note(number / 60, performer=0)
        rhythm.note(number / 60 + 0.004, performer=1)
    rate, jitter = rhythm.measure(240 / 60)
    assert rate == pytest.approx(120.0, rel=0.02)
    assert jitter == pytest.approx(0.0, abs=1e-9)
    uneven = Rhythm()
    for number in range(100):
        uneven.note(number / 50 + (0.005 if number % 2 else 0.0), performer=0)
    assert uneven.measure(2.0)[1] == pytest.approx(0.005, rel=0.05)  # steps of 25 and 15 ms
    assert uneven.measure(60.0) == (0.0, 0.0)


class Counting(Numbers):
    """A decoder that knows how many messages it was fed."""

    def __init__(self) -> None:
        super().__init__()
        self.fed = 0

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        self.fed += 1
        return super().feed(data, arrival)


def performers(senders: Senders, *messages: tuple[float, object]) -> list[int]:
    return [senders.feed(b"1", at, source)[0].performer for at, source in messages]


HERE, THERE = "10.0.0.1", "10.0.0.2"


def test_two_senders_on_one_port_are_two_performers() -> None:
    senders = Senders(Counting)
    order = [(t / 60, (host, 5000)) for t in range(10) for host in (HERE, THERE)]
    assert performers(senders, *order) == [0, 100] * 10
    assert [d.fed for d in senders.decoders if isinstance(d, Counting)] == [10, 10]


def test_two_senders_on_one_machine_are_two_performers() -> None:
    senders = Senders(Counting)
    order = [(t / 60, (HERE, port)) for t in range(20) for port in (5000, 5001)]
    assert sorted(set(performers(senders, *order)[10:])) == [0, 100]
    found = performers(senders, (0.5, (HERE, 5000)), (0.5, (HERE, 5001)), (0.5, (HERE, 5000)))
    assert found[0] == found[2] != found[1]


def test_a_sender_that_starts_again_is_the_same_performer() -> None:
    senders = Senders(Counting)
    assert performers(senders, *((t / 60, (HERE, 5000)) for t in range(60))) == [0] * 60
    assert performers(senders, *((3.0 + t / 60, (HERE, 6000)) for t in range(60))) == [0] * 60


def test_a_sender_with_a_new_port_for_each_packet_is_one() -> None:
    senders = Senders(Counting)
    assert performers(senders, *((t / 60, (HERE, 20_000 + t)) for t in range(300))) == [0] * 300


def test_no_more_senders_than_there_are_places_for() -> None:
    senders = Senders(Counting)
    hosts = [(f"10.0.1.{number}", 5000) for number in range(50)]
    for _ in range(2):
        for host in hosts:
            senders.feed(b"1", 1.0, host)
    assert len(senders.decoders) == MOST_SENDERS
    assert senders.crowded_out == senders.refused == 2 * (50 - MOST_SENDERS)
    assert performers(senders, (100.0, hosts[-1])) == [0]
