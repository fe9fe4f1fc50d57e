"""Cutting a byte stream into messages, however it arrives and whatever is in it."""

from __future__ import annotations

import random

import pytest

from devices.suits.xsens import HEADER, XsensDecoder, datagram_length
from devices.transport.tcp import LONGEST, Framing, take_messages
from tests.devices.sender_packets import XSENS, mxtp01, mxtp02, mxtp13, posed
from tests.devices.test_mutated_packets import MUTATIONS, damaged, xsens_packets
from tests.devices.transport.xsens_stream import GARBAGE, MXTP, header, pose


@pytest.mark.parametrize("step", [1, 7, 24, 759, 760, 761, 5000])
def test_messages_are_the_same_however_the_stream_is_split(step: int) -> None:
    sent = [pose(0), mxtp13(), mxtp01(posed(XSENS)), pose(1), b"".join(mxtp02(posed(XSENS)[:4]))]
    stream, data = b"".join(sent), bytearray()
    cut: list[bytes] = []
    for start in range(0, len(stream), step):
        data += stream[start : start + step]
        messages, sound = take_messages(data, MXTP)
        assert sound
        cut += messages
    assert cut == sent
    assert data == b""


def test_what_a_header_says_about_the_length() -> None:
    assert datagram_length(header(b"MXTP02", 23, 736)) == 760
    assert datagram_length(header(b"MXTP02", 23, 0)) == 760  # as old versions leave it
    assert datagram_length(header(b"MXTP01", 23, 0)) == 24 + 23 * 28
    assert datagram_length(header(b"MXTP02", 0, 0)) == 24
    assert datagram_length(header(b"MXTP25", 1, 16)) == 40
    assert datagram_length(header(b"MXTP13", 1, 65535)) == 24 + 65535


@pytest.mark.parametrize(
    "head",
    [
        header(b"MXTP02", 23, 735),
        header(b"MXTP02", 23, 65535),
        header(b"MXTP02", 255, 736),
        header(b"MXTP13", 1, 0),
        header(b"MXTPxx", 23, 736),
        header(b"mxtp02", 23, 736),
        bytes(24),
        GARBAGE[:24],
    ],
)
def test_what_is_noheader(head: bytes) -> None:
    assert datagram_length(head) is None
    data = bytearray(pose(0) + head + pose(1))
    assert take_messages(data, MXTP) == ([pose(0)], False)


@pytest.mark.parametrize("length", [None, -1, 0, 3, LONGEST + 1, 1 << 60])
def test_a_length_beyond_belief_is_noheader(length: int | None) -> None:
    data = bytearray(b"anything")
    assert take_messages(data, Framing("test", 4, lambda head: length)) == ([], False)


def test_damaged_streams_do_no_harm() -> None:
    chance, packets = random.Random(7), xsens_packets()
    decoder, data = XsensDecoder(), bytearray()
    frames = unsound = 0
    for number in range(MUTATIONS):
        data += damaged(chance, packets) if chance.random() < 0.1 else chance.choice(packets)
        messages, sound = take_messages(data, MXTP)
        for message in messages:
            frames += len(decoder.feed(message, 100.0 + number / 250))
        assert not sound or len(data) < HEADER.size + 65535
        if not sound:
            unsound += 1
            data.clear()  # as the next connection begins
    assert frames > 0
    assert unsound > 0
