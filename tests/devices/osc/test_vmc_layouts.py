"""Packets whose layout a VMC decoder knows: exactly what reading them message by message gives."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.bodies.humanoid_kernels import pose_in_world, read_bones
from devices.osc.messages import BUNDLE, elements, read_packet
from devices.osc.vmc_decoder import MARIONETTE, PERFORMER, VmcDecoder
from devices.skeleton import SkeletonFrame
from tests.devices.vmc_sender import HUMAN, at, bones, bundle, message, ok, root, slime
from tests.thorough import examples

POSE = (0.1, 1.0, 0.2, 0.0, 0.0, 0.0, 1.0)
ODD = (float("nan"), float("inf"), -0.0, 0.0, 0.5, 2.0, 999.0, 1e30, 1e-40)
NAMES = (*HUMAN.names[:30], "leftHAND", "LastBone", "Hips")

BONE = st.builds(lambda name: message("/VMC/Ext/Bone/Pos", name, *POSE), st.sampled_from(NAMES))
RUN = st.integers(0, 50).flatmap(
    lambda first: st.just(bones()[first : first + 6])  # the parts of one frame and of the next
)
OTHER = st.one_of(
    st.just(root()),
    st.just(ok(1, 3, 0, 1)),
    st.builds(at, st.sampled_from((0.5, 1.0, 2.0))),
    st.just(message("/VMC/Ext/Blend/Val", "Joy", 0.5)),
    st.just(message("/VMC/Ext/Blend/Apply")),
    st.just(message("/VMC/Ext/Bone/Pos", "Hips", *POSE, 1.0)),  # more than is asked for
    st.just(message("/VMC/Ext/Tra/Pos", "LeftFoot", *POSE)),
    st.just(message("/another/program", 1)),
)
MESSAGES = st.lists(st.one_of(RUN, OTHER.map(lambda one: [one]), BONE.map(lambda one: [one])))
PACKETS = MESSAGES.map(lambda groups: bundle([one for group in groups for one in group]))


@st.composite
def changed(draw: st.DrawFn, data: bytes) -> bytes:
    """The packet with other numbers, seldom with other bytes."""
    packet = bytearray(data)
    places = [end for _, end in elements(data)]
    for _ in range(draw(st.integers(0, 3)) if places else 0):
        number = draw(st.one_of(st.sampled_from(ODD), st.floats(-2.0, 2.0, width=32)))
        end = draw(st.sampled_from(places)) - 4 * draw(st.integers(0, 6))
        if end >= 4:
            packet[end - 4 : end] = struct.pack(">f", number)
    if packet and draw(st.integers(0, 9)) == 0:
        packet[draw(st.integers(0, len(packet) - 1))] = draw(st.integers(0, 255))
    return bytes(packet)


def contents(frames: Sequence[SkeletonFrame]) -> list[object]:
    return [
        (
            frame.time,
            frame.arrival,
            frame.positions.tobytes(),
            None if frame.rotations is None else frame.rotations.tobytes(),
            frame.confidence.tobytes(),
        )
        for frame in frames
    ]


@settings(deadline=None, max_examples=examples(300))
@given(st.data(), st.sampled_from((MARIONETTE, PERFORMER)))
def test_a_known_layout_changes_nothing(data: st.DataObject, role: str) -> None:
    knowing, strict = VmcDecoder(role), VmcDecoder(role)
    packets = data.draw(st.lists(PACKETS, min_size=1, max_size=3))
    arrival = 100.0
    for _ in range(data.draw(st.integers(2, 12))):
        packet = data.draw(st.sampled_from(packets).flatmap(changed))
        arrival += data.draw(st.sampled_from((0.0, 1e-4, 1 / 60, 0.3)))
        strict.layouts.clear()
        assert contents(knowing.feed(packet, arrival)) == contents(strict.feed(packet, arrival))
        assert knowing.refused == strict.refused
        assert knowing.expressions == strict.expressions


def test_a_whole_body_is_read_at_once() -> None:
    decoder = VmcDecoder()
    decoder.feed(slime(0.0), 100.0)
    data = slime(1 / 60)
    plan = decoder.layouts.find(data)
    assert plan is not None
    assert len(plan) == len(read_packet(data)) - len(HUMAN.names) + 1
    *_, frame = decoder.feed(data, 100.0 + 1 / 60)
    np.testing.assert_allclose(frame.positions, HUMAN.rest_positions, atol=1e-6)


def test_one_bone_beyond_belief_does_not_spoil_the_others() -> None:
    decoder = VmcDecoder()
    for k in range(2):
        decoder.feed(slime(k / 60), 100.0 + k / 60)
    packet = bytearray(slime(2 / 60))
    name = packet.index(b"LeftHand\0")
    packet[name + 12 : name + 16] = struct.pack(">f", float("nan"))
    assert decoder.layouts.find(bytes(packet)) is not None
    decoder.feed(bytes(packet), 100.0 + 2 / 60)
    assert decoder.refused == 1


def test_a_malformed_packet_of_a_known_length_is_refused() -> None:
    decoder = VmcDecoder()
    data = slime(0.0)
    decoder.feed(data, 100.0)
    assert decoder.feed(BUNDLE + bytes(8) + b"\xff" * (len(data) - 16), 100.1) == ()
    assert decoder.refused == 1


def test_no_packet_waits_for_the_compiler() -> None:
    """Each kernel is compiled once, when a decoder is made, for whatever comes to it later."""
    kernels = (read_bones, pose_in_world)
    body, tracked = VmcDecoder(tpose=0.02), VmcDecoder(PERFORMER)
    compiled = [len(kernel.signatures) for kernel in kernels]
    assert compiled == [1, 1]
    for k in range(6):
        body.feed(slime(k / 60), 100.0 + k / 60)
        body.feed(bundle(bones()[5:20]), 101.0 + k / 60)
        tracked.feed(bundle([message("/VMC/Ext/Hmd/Pos", "", *POSE), *bones()[30:40]]), k / 60)
    assert [len(kernel.signatures) for kernel in kernels] == compiled
