"""OSC: what python-osc writes is read, what it cannot survive is refused, nothing else raises."""

from __future__ import annotations

import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from devices.osc.messages import (
    BUNDLE,
    DEEPEST,
    OscError,
    read_packet,
    write_bundles,
    write_message,
)

ARGUMENTS = st.one_of(
    st.tuples(st.just("i"), st.integers(-(2**31), 2**31 - 1)),
    st.tuples(st.just("h"), st.integers(-(2**63), 2**63 - 1)),
    st.tuples(st.just("f"), st.floats(width=32, allow_nan=False)),
    st.tuples(st.just("d"), st.floats(allow_nan=False)),
    st.tuples(st.just("s"), st.text(st.characters(exclude_characters="\0", codec="utf-8"))),
    st.tuples(st.just("b"), st.binary(min_size=1, max_size=9)),
    st.tuples(st.just("T"), st.just(True)),
    st.tuples(st.just("F"), st.just(False)),
    st.tuples(st.just("N"), st.none()),
)


def independent(address: str, *typed: tuple[str, object]) -> OscMessage:
    builder = OscMessageBuilder(address)
    for tag, value in typed:
        builder.add_arg(value, tag)
    return builder.build()


@settings(deadline=None)
@given(st.lists(ARGUMENTS, max_size=70))
def test_what_python_osc_writes_is_read(typed: list[tuple[str, object]]) -> None:
    (message,) = read_packet(independent("/some/where", *typed).dgram)
    assert message.address == "/some/where"
    assert message.tags == "".join(tag for tag, _ in typed)
    assert list(message.arguments) == [value for _, value in typed]


@settings(deadline=None)
@given(st.lists(ARGUMENTS.filter(lambda typed: typed[0] in "sifhd"), max_size=20))
def test_what_is_written_python_osc_reads(typed: list[tuple[str, object]]) -> None:
    tags = "".join(tag for tag, _ in typed)
    data = write_message("/a", tags, *(value for _, value in typed))
    assert OscMessage(data).params == [value for _, value in typed]


def test_bundles_hold_messages_and_bundles_in_order() -> None:
    inner = OscBundleBuilder(IMMEDIATELY)
    inner.add_content(independent("/b", ("i", 2)))
    outer = OscBundleBuilder(2_000_000_000.0)  # far in the future, and read at once
    for content in (independent("/a", ("i", 1)), inner.build(), independent("/c", ("i", 3))):
        outer.add_content(content)
    assert [m.arguments[0] for m in read_packet(outer.build().dgram)] == [1, 2, 3]
    assert read_packet(BUNDLE + bytes(8)) == []


def test_bundles_are_written_no_longer_than_asked() -> None:
    messages = [write_message("/m", "i", number) for number in range(100)]
    bundles = list(write_bundles(messages, 200))
    assert max(len(one) for one in bundles) <= 200
    read = [m.params[0] for one in bundles for m in OscBundle(one)]
    assert read == list(range(100))
    assert [len(list(write_bundles([bytes(300)], 200))), list(write_bundles([], 200))] == [1, []]


def nested(depth: int) -> bytes:
    data = write_message("/deep", "i", 1)
    for _ in range(depth):
        data = BUNDLE + bytes(8) + struct.pack(">i", len(data)) + data
    return data


def test_bundles_nest_only_so_deep() -> None:
    assert len(read_packet(nested(DEEPEST))) == 1
    with pytest.raises(OscError, match="deep"):
        read_packet(nested(DEEPEST + 1))


def element(size: int, content: bytes = b"") -> bytes:
    return BUNDLE + bytes(8) + struct.pack(">i", size) + content


MESSAGE = write_message("/a", "i", 1)


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "0 bytes"),
        (b"/a\0", "3 bytes"),
        (b"/abc", "4 bytes"),
        (b"/abc/def", "does not end"),
        (bytes(8), "no address"),
        (b",i\0\0" + bytes(4), "no address"),
        (b"/a\0\0\0\0\0\0", "no type tags"),
        (b"/a\0\0" + bytes(2) + b",i", "no type tags"),
        (b"/a\0\0,i\0\0", "within its arguments"),
        (b"/a\0\0,fff\0\0\0\0" + bytes(8), "within its arguments"),
        (b"/a\0\0,s\0\0abcd", "does not end"),
        (b"/\xff\xfe\0,\0\0\0", "UTF-8"),
        (b"/a\0\0,s\0\0\xc3\x28\0\0", "UTF-8"),
        (b"/a\0\0,q\0\0" + bytes(4), "'q'"),
        (b"/a\0\0,i\0\0" + bytes(8), "4 bytes more"),
        (b"/a\0\0,b\0\0" + struct.pack(">i", -4), "claims -4"),
        (b"/a\0\0,b\0\0" + struct.pack(">i", 2**31 - 1), "claims"),
        (b"/a\0\0,b\0\0", "no size"),
        (BUNDLE + bytes(4), "no time tag"),
        (element(-4), "claims -4"),
        (element(-(2**31)), "claims"),
        (element(0), "claims 0"),
        (element(4, b"/abc"), "claims 4"),
        (element(10_000, MESSAGE), "claims 10000"),
        (element(12, MESSAGE + MESSAGE), "claims"),
        (element(len(MESSAGE), MESSAGE) + bytes(4), "claims"),
        (element(10, MESSAGE + bytes(2)) + bytes(2), "bytes"),
    ],
)
def test_what_is_malformed_is_refused_whole(data: bytes, why: str) -> None:
    with pytest.raises(OscError, match=why):
        read_packet(data)


def test_no_bytes_raise_anything_else() -> None:
    chance = random.Random(1)
    good = bytearray(element(len(MESSAGE), MESSAGE) + struct.pack(">i", 40) + nested(1))
    for _ in range(20_000):
        data = bytearray(good[: chance.randrange(len(good) + 1)])
        for _ in range(chance.randrange(4)):
            if data:
                data[chance.randrange(len(data))] = chance.choice((0, 1, 44, 47, 127, 255))
        try:
            read_packet(bytes(data))
        except OscError:
            continue
