"""TCP: senders connect to us, and no sender harms another."""

from __future__ import annotations

import os
import socket
import struct
import sys
import threading
import time
from collections.abc import Hashable, Iterator
from contextlib import ExitStack, contextmanager
from urllib.parse import urlsplit

import numpy as np
import pytest

from devices.errors import InputError
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.suits.xsens import XsensDecoder
from devices.transport.live_stream import LiveStream
from devices.transport.senders import MOST_SENDERS
from devices.transport.tcp import LONGEST, Framing, TcpTransport, take_messages
from tests.devices.sender_packets import XSENS, mxtp02, mxtp13, posed
from tests.devices.transport.xsens_stream import (
    GARBAGE,
    MXTP,
    PREFIXED,
    expected,
    header,
    heights,
    pose,
)
from tests.waiting import PATIENCE


@pytest.fixture
def stream() -> Iterator[LiveStream]:
    with open_stream("xsens://127.0.0.1:0?transport=tcp") as opened:
        assert isinstance(opened, LiveStream)
        yield opened


def connect(stream: LiveStream) -> socket.socket:
    transport = stream.transport
    assert isinstance(transport, TcpTransport)
    return socket.create_connection((transport.host, transport.port), PATIENCE)


def received(stream: LiveStream, count: int) -> list[SkeletonFrame]:
    """The next frames, as soon as there are so many."""
    frames: list[SkeletonFrame] = []
    while len(frames) < count:
        assert stream.wait(PATIENCE), f"only {len(frames)} of {count} frames came"
        frames += stream.poll()
    return frames


def closed_by_us(sender: socket.socket) -> bool:
    """Whether the other end closes the connection, waiting for it."""
    try:
        return sender.recv(1) == b""
    except ConnectionError:
        return True


# -- over a socket --------------------------------------------------------------------------------


def test_a_pose_comes_whole_with_its_arrival(stream: LiveStream) -> None:
    with connect(stream) as sender:
        sender.sendall(pose(3))
        (frame,) = received(stream, 1)
    assert frame.positions == pytest.approx(posed(XSENS, 3), abs=1e-5)
    assert frame.performer == 0
    traffic = stream.traffic
    assert (traffic.packets, traffic.frames, traffic.refused, traffic.trouble) == (1, 1, 0, "")
    assert traffic.last_seen == frame.arrival


def test_byte_by_byte(stream: LiveStream) -> None:
    with connect(stream) as sender:
        sender.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        frames: list[SkeletonFrame] = []
        for k in range(2):
            for byte in pose(k):
                last = time.perf_counter()
                sender.send(bytes([byte]))
            frames += received(stream, 1)
            assert last < frames[-1].arrival  # of the last byte
    assert heights(frames) == pytest.approx(expected(0, 1), abs=1e-5)


def test_many_in_one_write_and_kinds_without_a_pose_between(stream: LiveStream) -> None:
    with connect(stream) as sender:
        sender.sendall(b"".join(pose(k) + mxtp13() for k in range(50)))
        frames = received(stream, 50)
    assert heights(frames) == pytest.approx(expected(*range(50)), abs=1e-5)
    assert stream.traffic.refused == 0


def test_connections_have_decoders_of_their_own(stream: LiveStream) -> None:
    with connect(stream) as first, connect(stream) as second:
        for k in range(5):
            halves = pose(k)[:400], pose(k)[400:]
            for half in halves:  # each is in the middle of a message while the other goes on
                first.sendall(half)
                second.sendall(half)
        frames = received(stream, 10)
    performers = {frame.performer for frame in frames}
    assert len(performers) == 2
    for performer in performers:
        of_one = [frame for frame in frames if frame.performer == performer]
        assert heights(of_one) == pytest.approx(expected(*range(5)), abs=1e-5)


@pytest.mark.parametrize(
    "garbage",
    [
        GARBAGE,
        bytes(100),
        b"\xff" * 65536,
        header(b"MXTP02", 255, 65535),
        header(b"MXTP13", 1, 0),
    ],
)
def test_garbage_closes_its_connection_and_no_other(stream: LiveStream, garbage: bytes) -> None:
    with connect(stream) as good, connect(stream) as bad:
        good.sendall(pose(0))
        frames = received(stream, 1)
        bad.sendall(garbage)
        assert closed_by_us(bad)
        good.sendall(pose(1))
        frames += received(stream, 1)
        assert heights(frames) == pytest.approx(expected(0, 1), abs=1e-5)
        trouble = stream.traffic.trouble
    assert "no MXTP message" in trouble
    assert "\n" not in trouble


def test_what_came_before_garbage_counts(stream: LiveStream) -> None:
    with connect(stream) as sender:
        sender.sendall(pose(0) + pose(1) + GARBAGE)
        assert heights(received(stream, 2)) == pytest.approx(expected(0, 1), abs=1e-5)
        assert closed_by_us(sender)


def test_trouble_is_over_when_the_next_connection_has_sent_a_message(stream: LiveStream) -> None:
    with connect(stream) as bad:
        bad.sendall(GARBAGE)
        assert closed_by_us(bad)
    assert stream.traffic.trouble
    with connect(stream) as good:
        good.sendall(pose(0))
        received(stream, 1)
    assert stream.traffic.trouble == ""


@pytest.mark.parametrize("how", ["closes", "resets"])
def test_who_goes_in_the_middle_of_a_message_may_come_again(stream: LiveStream, how: str) -> None:
    with connect(stream) as other:
        other.sendall(pose(0, who=5))
        received(stream, 1)
        for k in (0, 10, 20):
            sender = connect(stream)
            sender.sendall(pose(k) + pose(k + 1)[:300])
            received(stream, 1)
            if how == "resets":
                sender.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            sender.close()
        other.sendall(pose(1, who=5))
        received(stream, 1)
        assert stream.traffic.frames == 5


def test_who_connects_again_is_the_same_performer(stream: LiveStream) -> None:
    performers = set()
    for k in range(4):
        with connect(stream) as sender:
            sender.sendall(pose(2 * k) + pose(2 * k + 1))
            performers |= {frame.performer for frame in received(stream, 2)}
            sender.shutdown(socket.SHUT_WR)
            assert closed_by_us(sender)
    assert performers == {0}


def test_more_than_can_be_heard_are_refused_until_one_goes(stream: LiveStream) -> None:
    with ExitStack() as held:
        senders = [held.enter_context(connect(stream)) for _ in range(MOST_SENDERS)]
        with connect(stream) as excess:
            assert closed_by_us(excess)
        assert "refused" in stream.traffic.trouble
        senders[3].shutdown(socket.SHUT_WR)
        assert closed_by_us(senders[3])
        with connect(stream) as sender:
            sender.sendall(pose(0))
            received(stream, 1)


def test_the_longest_silent_gives_way() -> None:
    with listening(PREFIXED) as (transport, messages), ExitStack() as held:
        where = (transport.host, transport.port)
        senders = [
            held.enter_context(socket.create_connection(where, PATIENCE))
            for _ in range(MOST_SENDERS)
        ]
        for number, one in enumerate(senders):
            one.sendall(b"\0\0\0\1" + bytes([number]))
            messages.wait_for(number + 1)
        for connection in transport._connections:
            connection.heard -= 100.0 if connection.source == "127.0.0.1 2" else 20.0
        with socket.create_connection(where, PATIENCE) as late:
            late.sendall(b"\0\0\0\1x")
            messages.wait_for(MOST_SENDERS + 1)
            assert messages.heard[-1] == (b"\0\0\0\1x", "127.0.0.1 2")
            assert closed_by_us(senders[2])


class Messages:
    """What was delivered, and by whom."""

    def __init__(self) -> None:
        self.heard: list[tuple[bytes, Hashable]] = []
        self._came = threading.Condition()

    def deliver(self, data: bytes, arrival: float, source: Hashable) -> None:
        with self._came:
            self.heard.append((data, source))
            self._came.notify_all()

    def wait_for(self, count: int) -> None:
        with self._came:
            assert self._came.wait_for(lambda: len(self.heard) >= count, PATIENCE)


@contextmanager
def listening(framing: Framing, host: str = "127.0.0.1") -> Iterator[tuple[TcpTransport, Messages]]:
    transport, messages = TcpTransport(host, 0, scheme="test", framing=framing), Messages()
    thread = threading.Thread(target=transport.run, args=(messages.deliver,))
    thread.start()
    try:
        yield transport, messages
    finally:
        transport.close()
        thread.join(PATIENCE)
        assert not thread.is_alive()


def test_a_machine_that_vanished_will_be_noticed() -> None:
    with (
        listening(PREFIXED) as (transport, messages),
        socket.create_connection((transport.host, transport.port), PATIENCE) as sender,
    ):
        sender.sendall(bytes(4))
        messages.wait_for(1)
        (connection,) = transport._connections
        assert connection.stream.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)


@pytest.mark.parametrize("host", ["localhost", "::1"])
def test_messages_of_any_size_come_in_order(host: str) -> None:
    try:
        TcpTransport(host, 0, scheme="test", framing=PREFIXED).close()
    except InputError as error:
        pytest.skip(f"this machine has no such loopback: {error}")
    sizes = [0, 1, 16_380, 16_384, 100_000, LONGEST - 4, 0]
    with listening(PREFIXED, host) as (transport, messages):
        with socket.create_connection((transport.host, transport.port), PATIENCE) as sender:
            for size in sizes:
                sender.sendall(struct.pack(">I", size) + bytes(size))
            messages.wait_for(len(sizes))
        assert [len(data) - 4 for data, _ in messages.heard] == sizes


def test_a_flood_is_held_back_and_nothing_is_lost(stream: LiveStream) -> None:
    count = 1000
    flood = b"".join(pose(k) for k in range(count))
    with connect(stream) as sender:
        writer = threading.Thread(target=sender.sendall, args=(flood,))
        writer.start()
        frames = 0
        while stream.traffic.frames < count:
            assert stream.wait(PATIENCE)
            frames += len(stream.poll())
        writer.join(PATIENCE)
    traffic = stream.traffic
    assert traffic.packets == traffic.frames == count
    assert traffic.refused == 0


# -- opening and closing --------------------------------------------------------------------------


def test_closing_ends_its_connections_and_gives_the_port_back() -> None:
    with open_stream("xsens://127.0.0.1:0?transport=tcp") as stream:
        assert isinstance(stream, LiveStream)
        silent, busy = connect(stream), connect(stream)
        busy.sendall(pose(0) + pose(1)[:50])
        received(stream, 1)
        port = stream.transport.port
    assert not stream._thread.is_alive()
    with silent, busy:
        assert closed_by_us(silent)
        assert closed_by_us(busy)
    with open_stream(f"xsens://127.0.0.1:{port}?transport=tcp") as again:
        assert isinstance(again, LiveStream)
        with connect(again) as sender:
            sender.sendall(pose(0))
            received(again, 1)


def test_one_that_never_ran_gives_the_port_back_too() -> None:
    transport = TcpTransport("127.0.0.1", 0, scheme="test", framing=MXTP)
    transport.close()
    transport.close()
    transport.run(lambda data, arrival, source: None)  # comes back at once
    TcpTransport("127.0.0.1", transport.port, scheme="test", framing=MXTP).close()


def test_a_port_that_is_taken_is_one_line_with_who_has_it_and_another() -> None:
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        port = holder.getsockname()[1]
        with pytest.raises(InputError) as refused:
            open_stream(f"xsens://127.0.0.1:{port}?transport=tcp")
    text = str(refused.value)
    assert "\n" not in text
    assert f"TCP port {port} is taken by" in text
    other = urlsplit(text.split("e.g. ")[1]).port
    assert other is not None
    TcpTransport("127.0.0.1", other, scheme="test", framing=MXTP).close()
    if sys.platform.startswith("linux"):
        assert f"(process {os.getpid()})" in text


@pytest.mark.parametrize(
    ("host", "why"),
    [
        ("no.such.host.invalid", "no host is called"),
        ("192.0.2.1", "no address of this machine"),
        ("x" * 300, "no host is called"),
    ],
)
def test_what_cannot_be_bound_is_one_line(host: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        TcpTransport(host, 0, scheme="test", framing=MXTP)


def test_it_listens_on_this_machine_only_and_by_udp_where_not_told_otherwise() -> None:
    with open_stream("xsens://:0?transport=tcp") as stream:
        assert isinstance(stream, LiveStream)
        assert stream.transport.host == "127.0.0.1"
    with open_stream("xsens://:0") as stream:
        assert isinstance(stream, LiveStream)
        assert not isinstance(stream.transport, TcpTransport)
    with pytest.raises(InputError, match="udp or tcp"):
        open_stream("xsens://:0?transport=sctp")


def test_the_golden_stream() -> None:
    places = posed(XSENS)
    messages, sound = take_messages(bytearray(b"".join(mxtp02(places, parts=3))), MXTP)
    assert sound
    assert len(messages) == 3
    frames = [frame for data in messages for frame in XsensDecoder().feed(data, 1.0)]
    assert frames == []  # each alone is no pose
    decoder = XsensDecoder()
    (frame,) = [frame for data in messages for frame in decoder.feed(data, 1.0)]
    assert np.allclose(frame.positions, places, atol=1e-5)
