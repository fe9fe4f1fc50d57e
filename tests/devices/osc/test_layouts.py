"""A packet with a known layout gives the learned plan with the packet's own numbers."""

from __future__ import annotations

import struct

from hypothesis import given, settings
from hypothesis import strategies as st

from devices.osc.layouts import MOST_A_LENGTH, MOST_LENGTHS, Layouts
from devices.osc.messages import BUNDLE, Message, OscError, elements, numbers_at_end, read_packet
from tests.devices.vmc_sender import at, bones, bundle, message, ok

PACKETS = (
    bundle([at(1.5), ok(1, 3, 0, 1), *bones()[:6]]),
    bundle([message("/mixed", 1.5, "text", 2, 3.5, "end"), message("/none"), *bones()[20:25]]),
    BUNDLE + bytes(8) + struct.pack(">i", len(bundle(bones()[:4]))) + bundle(bones()[:4]),
    bones()[0].dgram,
)


def said(data: bytes) -> list[tuple[tuple[int, int], Message]]:
    return list(zip(elements(data), read_packet(data), strict=True))


def without_numbers(messages: list[Message]) -> list[tuple[str, str, list[object]]]:
    def kept(message: Message) -> list[object]:
        return [a for a in message.arguments if not isinstance(a, int | float)]

    return [(one.address, one.tags, kept(one)) for one in messages]


def learned(*packets: bytes) -> Layouts[int]:
    layouts: Layouts[int] = Layouts()
    for number, data in enumerate(packets):
        layouts.learn(data, said(data), number)
    return layouts


@settings(deadline=None)
@given(st.data())
def test_only_numbers_may_differ(data: st.DataObject) -> None:
    layouts = learned(*PACKETS)
    which = data.draw(st.integers(0, len(PACKETS) - 1))
    packet = bytearray(PACKETS[which])
    assert layouts.find(bytes(packet)) == which
    for _ in range(data.draw(st.integers(1, 3))):
        packet[data.draw(st.integers(0, len(packet) - 1))] = data.draw(st.integers(0, 255))
    found = layouts.find(bytes(packet))
    try:
        other = read_packet(bytes(packet))
    except OscError:
        assert found is None
        return
    if found is not None:
        assert found == which
        assert without_numbers(other) == without_numbers(read_packet(PACKETS[which]))


def test_every_number_at_the_end_of_a_message_may_differ() -> None:
    for which, data in enumerate(PACKETS):
        other = bytearray(data)
        for (_, end), message_ in said(data):
            count = numbers_at_end(message_.tags)
            other[end - count : end] = b"\x41" * count
        assert bytes(other) != data
        assert learned(*PACKETS).find(bytes(other)) == which
    tagged = bytearray(PACKETS[0])
    tagged[8:16] = b"\x01" * 8  # the time tag, which nobody waits for
    assert learned(*PACKETS).find(bytes(tagged)) == 0


def test_which_numbers_end_a_message() -> None:
    assert [numbers_at_end(tags) for tags in ("", "s", "sf", "fsii", "hdtT", "sfffffff")] == [
        *(0, 0, 4, 8, 0, 28)
    ]
    assert numbers_at_end("hdt") == 24


def test_how_many_are_known_is_bounded() -> None:
    same_length = [message("/name", f"{n:04}", 1.0).dgram for n in range(MOST_A_LENGTH + 1)]
    layouts = learned(*same_length)
    assert [layouts.find(one) for one in same_length] == [None, *range(1, MOST_A_LENGTH + 1)]
    longer = [message("/" + "long" * n, 1.0).dgram for n in range(MOST_LENGTHS + 1)]
    layouts = learned(*longer)
    assert [layouts.find(one) for one in longer] == [None, *range(1, MOST_LENGTHS + 1)]
    layouts.clear()
    assert layouts.find(longer[-1]) is None
    assert layouts.find(b"") is None
