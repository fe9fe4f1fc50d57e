"""Poses of Xsens MVN as bytes of a TCP stream, and how the stream is cut."""

from __future__ import annotations

import struct

from devices.skeleton import SkeletonFrame
from devices.suits.xsens import HEADER, datagram_length
from devices.transport.tcp import Framing
from tests.devices.sender_packets import XSENS, mxtp02, posed

MXTP = Framing("MXTP", HEADER.size, datagram_length)
PREFIXED = Framing("test", 4, lambda head: 4 + struct.unpack(">I", head)[0])
GARBAGE = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


def pose(k: int, who: int = 0) -> bytes:
    (data,) = mxtp02(posed(XSENS, k), counter=k, time_ms=17 * k, who=who)
    return data


def heights(frames: list[SkeletonFrame]) -> list[float]:
    """Of the raised hand, which tells a pose from another."""
    return [float(frame.positions[XSENS.index("LeftHand"), 1]) for frame in frames]


def expected(*numbers: int) -> list[float]:
    return [float(posed(XSENS, k)[XSENS.index("LeftHand"), 1]) for k in numbers]


def header(kind: bytes, count: int, size: int) -> bytes:
    return struct.pack(">6sIBBIBBBBHH", kind, 1, 0x80, count, 0, 0, 23, 0, 0, 0, size)
