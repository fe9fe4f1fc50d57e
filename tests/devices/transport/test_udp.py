"""UDP: this machine only, whole datagrams, one line where a port is taken, floods survived."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Sequence
from urllib.parse import urlsplit

import numpy as np
import pytest

from devices.address import host_and_port, one_of, options_of, positive
from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from devices.transport.live_stream import LiveStream
from devices.transport.port_owner import port_owner
from devices.transport.udp import LONGEST, UdpTransport
from tests.waiting import PATIENCE

ON_LINUX = sys.platform.startswith("linux")


class Lengths:
    """Frames that tell how long each message was; sets `heard` when one of `awaited` bytes came."""

    skeleton = Skeleton(("point",), np.array([-1]), np.zeros((1, 3)))
    refused = 0

    def __init__(self, awaited: int) -> None:
        self.awaited = awaited
        self.heard = threading.Event()

    def feed(self, data: bytes, arrival: float) -> Sequence[SkeletonFrame]:
        if len(data) == self.awaited:
            self.heard.set()
        place = np.array([[float(len(data)), 0.0, 0.0]])
        return [SkeletonFrame(arrival, place, None, np.ones(1), arrival=arrival)]


def sender() -> socket.socket:
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_datagrams_of_any_size_come_whole_and_in_order(host: str) -> None:
    if host == "::1" and not socket.has_ipv6:
        pytest.skip("needs IPv6")
    try:
        transport = UdpTransport(host, 0, scheme="test")
    except InputError as error:
        if host != "::1":
            raise
        pytest.skip(f"this machine has no IPv6 loopback: {error}")
    decoder = Lengths(awaited=7)
    sizes = [0, 1, 1500, 9000, 60_000, 65_507 if host != "::1" else 65_000, 7]
    with LiveStream(transport, lambda: decoder) as stream:
        family = socket.AF_INET6 if transport.host == "::1" else socket.AF_INET
        with socket.socket(family, socket.SOCK_DGRAM) as out:
            for size in sizes:
                out.sendto(bytes(size), (transport.host, transport.port))
        assert decoder.heard.wait(PATIENCE)
        frames = stream.poll()
    assert [frame.positions[0, 0] for frame in frames] == sizes
    assert LONGEST >= 65_507
    arrivals = [frame.arrival for frame in frames]
    assert arrivals == sorted(arrivals)


def test_a_port_that_is_taken_is_one_line_with_who_has_it_and_another() -> None:
    with sender() as holder:
        holder.bind(("127.0.0.1", 0))
        port = holder.getsockname()[1]
        with pytest.raises(InputError) as refused:
            UdpTransport("127.0.0.1", port, scheme="vmc")
    text = str(refused.value)
    assert "\n" not in text
    assert f"UDP port {port} is taken by" in text
    other = urlsplit(text.split("e.g. ")[1]).port
    assert other is not None
    UdpTransport("127.0.0.1", other, scheme="vmc").close()
    if ON_LINUX:
        assert f"(process {os.getpid()})" in text


@pytest.mark.skipif(not ON_LINUX, reason="only Linux tells by /proc who holds a port")
def test_who_holds_a_port() -> None:
    with socket.socket() as listening, sender() as bound:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        bound.bind(("127.0.0.1", 0))
        tcp, udp = listening.getsockname()[1], bound.getsockname()[1]
        for port, protocol in ((tcp, "tcp"), (udp, "udp")):
            owner = port_owner(port, protocol)
            assert owner is not None
            assert owner.process == os.getpid()
            assert owner.name
    assert port_owner(udp, "udp") is None


@pytest.mark.parametrize(
    ("host", "port", "why"),
    [
        ("no.such.host.invalid", 0, "no host is called"),
        ("192.0.2.1", 0, "no address of this machine"),
        ("x" * 300, 0, "no host is called"),
    ],
)
def test_what_cannot_be_bound_is_one_line(host: str, port: int, why: str) -> None:
    with pytest.raises(InputError, match=why):
        UdpTransport(host, port, scheme="test")


def test_a_flood_is_survived_and_the_newest_is_heard() -> None:
    flood = (
        "import socket, sys\n"
        "out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\n"
        "for _ in range(100_000): out.sendto(bytes(100), ('127.0.0.1', int(sys.argv[1])))\n"
    )
    decoder = Lengths(awaited=7)
    transport = UdpTransport("127.0.0.1", 0, scheme="test")
    with LiveStream(transport, lambda: decoder, capacity=256) as stream, sender() as out:
        process = subprocess.Popen([sys.executable, "-c", flood, str(transport.port)])
        most = 0
        while process.poll() is None:
            most = max(most, len(stream.poll()))
        assert process.returncode == 0
        for _ in range(1000):  # the queue may still be full: a datagram more or less is lost
            out.sendto(bytes(7), ("127.0.0.1", transport.port))
            if decoder.heard.wait(0.03):
                break
        assert decoder.heard.is_set()
        traffic = stream.traffic
    assert most <= 256
    assert 0 < traffic.frames == traffic.packets <= 100_000 + 1000
    if ON_LINUX:
        assert traffic.packets + traffic.dropped > 50_000


def test_closing_gives_the_port_back_and_may_be_done_twice() -> None:
    transport = UdpTransport("127.0.0.1", 0, scheme="test")
    stream = LiveStream(transport, lambda: Lengths(0))
    stream.close()
    stream.close()
    UdpTransport("127.0.0.1", transport.port, scheme="test").close()


def test_addresses_say_host_and_port_and_options() -> None:
    assert host_and_port(urlsplit("vmc://"), 39539) == ("127.0.0.1", 39539)
    assert host_and_port(urlsplit("vmc://:1234"), 39539) == ("127.0.0.1", 1234)
    assert host_and_port(urlsplit("vmc://[::1]:0/"), 39539) == ("::1", 0)
    options = {"scale": positive, "role": one_of("a", "b")}
    assert options_of(urlsplit("vmc://h?scale=2&role=b"), options) == {"scale": 2.0, "role": "b"}


@pytest.mark.parametrize("url", ["vmc://h:70000", "vmc://h:x", "vmc://h:1/path", "vmc://me@h:1"])
def test_what_is_no_host_and_port_is_one_line(url: str) -> None:
    with pytest.raises(InputError, match="cannot open"):
        host_and_port(urlsplit(url), 39539)


@pytest.mark.parametrize(
    ("query", "why"),
    [
        ("size=2", "'size' is unknown to vmc://; known options: scale, role"),
        ("scale=0", "above 0"),
        ("scale=nan", "above 0"),
        ("scale=", "above 0"),
        ("role=c", "a or b"),
        ("scale=1&scale=2", "twice"),
    ],
)
def test_what_is_no_option_is_one_line(query: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        options_of(urlsplit(f"vmc://h?{query}"), {"scale": positive, "role": one_of("a", "b")})
