"""A bridge over real sockets: stages come and go, bridges die, versions differ."""

from __future__ import annotations

import os
import threading
import time

import numpy as np
import pytest
import zmq

from devices.bridge.messages import (
    LATEST,
    LOSSLESS,
    VERSION,
    Call,
    OtherVersion,
    decode,
    encode_call,
)
from devices.bridge.stream import Bridge, BridgeStream
from devices.errors import InputError
from tests.runtime.cli.loopback import (
    BODY,
    Told,
    bridge,
    frame,
    numbers,
    publish_until_heard,
    raw,
    take_until,
)
from tests.waiting import PATIENCE


def test_lossless_loses_nothing_past_a_reader_that_stands_still() -> None:
    with bridge() as publisher, BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as stream:
        for number in range(1, 5001):
            publisher.write(frame(number))
        early = take_until(stream, 100)  # then it stands still while twice as many come
        for number in range(5001, 10_001):
            publisher.write(frame(number))
        frames = early + take_until(stream, 10_000)
        assert numbers(frames) == list(range(1, 10_001))
        assert stream.traffic.dropped == publisher.lost == 0


def test_latest_wins_past_a_reader_that_stands_still() -> None:
    with bridge() as publisher, BridgeStream(Bridge(publisher.endpoint, LATEST)) as stream:
        tapped = threading.Event()
        stream.tap(lambda one: tapped.set() if int(one.positions[0, 0]) >= 2999 else None)
        for number in range(1, 3001):
            publisher.write(frame(number, performer=number % 3))
        assert tapped.wait(PATIENCE)
        frames = take_until(stream, 3000)
        newest = {
            one.performer: number for one, number in zip(frames, numbers(frames), strict=True)
        }
        assert newest == {1: 2998, 2: 2999, 0: 3000}, "the newest of each performer"
        assert len(frames) <= 6, "and hardly more"
        assert stream.traffic.dropped >= 3000 - 6
        assert stream.traffic.frames + stream._receiver.lost == 3000


def test_who_comes_late_gets_the_skeleton_and_goes_on_from_there() -> None:
    with bridge() as publisher, BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as first:
        for number in range(1, 101):
            publisher.write(frame(number))
        assert numbers(take_until(first, 100)) == list(range(1, 101))
        with BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as late:
            np.testing.assert_array_equal(late.skeleton.rest_positions, BODY.rest_positions)
            publisher.write(frame(101))
            assert numbers(take_until(late, 101)) == [101]
            assert late.traffic.dropped == 0
        assert numbers(take_until(first, 101)) == [101]


def test_a_bridge_that_dies_and_comes_back_is_found_again() -> None:
    with bridge() as publisher:
        endpoint = publisher.endpoint
        stream = BridgeStream(Bridge(endpoint, LOSSLESS))
        assert publish_until_heard(publisher, stream)
    with stream:
        with bridge(endpoint) as again:
            assert publish_until_heard(again, stream)
            assert stream.traffic.trouble == ""
        assert stream._receiver.strange is False


def test_a_stage_that_starts_before_the_bridge_waits_for_it() -> None:
    with bridge() as publisher:
        endpoint = publisher.endpoint  # free again when this one is gone
    opened: list[BridgeStream] = []

    def open_it() -> None:
        opened.append(BridgeStream(Bridge(endpoint, patience=PATIENCE)))

    opening = threading.Thread(target=open_it)
    opening.start()
    with bridge(endpoint) as publisher:
        opening.join(PATIENCE)
        with opened[0] as stream:
            assert publish_until_heard(publisher, stream)


def test_the_clock_of_the_other_machine_is_taken_out() -> None:
    """The bridge's clock is an hour and more ahead; the bound is what the line allows."""
    ahead = 4000.25
    with (
        bridge(clock=lambda: time.monotonic() + ahead) as publisher,
        BridgeStream(Bridge(publisher.endpoint)) as stream,
    ):
        now = time.monotonic()
        publisher.write(frame(1, time=now + ahead))
        (heard,) = take_until(stream, 1)
        clock = stream._receiver.clock
        assert abs(clock.seconds - ahead) <= clock.bound
        assert abs(heard.time - now) <= clock.bound
        assert heard.time <= heard.arrival


def test_a_bridge_of_another_version_is_told_in_one_line() -> None:
    def answer(socket: zmq.Socket) -> None:
        route, said = socket.recv_multipart()
        assert isinstance(decode(said), Call)
        socket.send_multipart((route, b"BNRK\x07\x02\0\0 words of a later age"))

    with raw(zmq.ROUTER) as (socket, endpoint):
        answering = threading.Thread(target=answer, args=(socket,))
        answering.start()
        with pytest.raises(InputError, match=f"speaks version 7 and we speak {VERSION}"):
            BridgeStream(Bridge(endpoint, patience=PATIENCE))
        answering.join(PATIENCE)


def test_a_stage_of_another_version_is_told_and_tells() -> None:
    told = Told()
    with bridge(told=told) as publisher, raw(zmq.DEALER, publisher.endpoint) as (socket, _):
        said = bytearray(encode_call(Call(1, 0, 0, 0.0, 8, LATEST)))
        said[4] = 9
        socket.send(said)
        assert socket.poll(int(PATIENCE * 1000))
        reply = bytearray(socket.recv())
        assert reply[4] == VERSION, "so that the other side can name us"
        told.wait_for("uses version 9")
    reply[4] = 9
    assert decode(bytes(reply)) == OtherVersion(9)


def test_a_flood_from_a_stranger_leaves_the_bridge_serving() -> None:
    stop, served = threading.Event(), threading.Event()

    def flood(socket: zmq.Socket) -> None:
        noise = [os.urandom(size) for size in (0, 1, 46, 300)]
        call = encode_call(Call(1, 2, 3, 4.0, 5, LATEST))
        while not stop.is_set():
            for data in (*noise, call):
                with_room = socket.poll(10, zmq.POLLOUT)
                if with_room:
                    socket.send(data, zmq.NOBLOCK)
            if publisher.subscribers.count == 2:
                served.set()

    with (
        bridge() as publisher,
        BridgeStream(Bridge(publisher.endpoint, LOSSLESS)) as stream,
        raw(zmq.DEALER, publisher.endpoint) as (socket, _),
    ):
        flooding = threading.Thread(target=flood, args=(socket,))
        flooding.start()
        try:
            assert served.wait(PATIENCE), "its own call is one like any other"
            for number in range(1, 301):
                publisher.write(frame(number))
            assert numbers(take_until(stream, 300)) == list(range(1, 301))
        finally:
            stop.set()
            flooding.join(PATIENCE)
        assert publisher.subscribers.refused > 0
        assert publisher.subscribers.count == 2


def test_closing_is_quick_quiet_and_may_come_twice() -> None:
    with bridge() as publisher:
        stream = BridgeStream(Bridge(publisher.endpoint))
        before = threading.active_count()
        stream.close()
        stream.close()
        assert stream.ended
        assert list(stream.poll()) == []
        assert threading.active_count() == before - 1
        publisher.close()


def test_what_was_handed_over_last_still_arrives() -> None:
    with bridge() as publisher:
        stream = BridgeStream(Bridge(publisher.endpoint, LOSSLESS))
        for number in range(1, 2001):
            publisher.write(frame(number))
        closing = threading.Thread(target=publisher.close)
        closing.start()
        with stream:
            assert numbers(take_until(stream, 2000)) == list(range(1, 2001))
        closing.join(PATIENCE)
