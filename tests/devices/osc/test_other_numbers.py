"""Numbers as python-osc and others send them: whole ones as ints, or all of them as doubles."""

from __future__ import annotations

import numpy as np
import pytest
from pythonosc.osc_message_builder import OscMessageBuilder

from devices.osc.vmc_decoder import VmcDecoder
from devices.osc.vrchat import JOINTS, VrchatDecoder

BONES = {
    "Hips": (0, 1, 0),
    "Spine": (0, 0.1, 0),
    "Chest": (0, 0.2, 0),
    "Neck": (0, 0.2, 0),
    "Head": (0, 0.1, 0),
    "LeftUpperLeg": (-0.1, 0, 0),
    "LeftLowerLeg": (0, -0.45, 0),
    "LeftFoot": (0, -0.45, 0),
}


def message(address: str, *arguments: object, tag: str | None = None) -> bytes:
    builder = OscMessageBuilder(address)
    for argument in arguments:
        numeric = tag is not None and not isinstance(argument, str)
        builder.add_arg(float(argument) if numeric else argument, tag if numeric else None)
    return builder.build().dgram


@pytest.mark.parametrize("tag", [None, "d", "f", "h"])
def test_vmc_bones_in_any_numbers_give_every_frame(tag: str | None) -> None:
    decoder, frames = VmcDecoder(), []
    bones = BONES if tag != "h" else dict.fromkeys(BONES, (0, 1, 0))
    for number in range(90):
        arrival = number / 30
        for name, place in bones.items():
            numbers = [*place, 0, 0, 0, 1]
            if tag == "h":
                builder = OscMessageBuilder("/VMC/Ext/Bone/Pos")
                builder.add_arg(name)
                for value in numbers:
                    builder.add_arg(value, "h")
                datagram = builder.build().dgram
            else:
                datagram = message("/VMC/Ext/Bone/Pos", name, *numbers, tag=tag)
            frames += decoder.feed(datagram, arrival)
        frames += decoder.feed(message("/VMC/Ext/Blend/Val", "Joy", 1, tag=tag and "f"), arrival)
        frames += decoder.feed(message("/VMC/Ext/Blend/Apply"), arrival)
        frames += decoder.feed(message("/VMC/Ext/OK", 1), arrival)
        frames += decoder.feed(message("/VMC/Ext/T", number / 30, tag=tag and "d"), arrival)
    assert decoder.refused == 0
    assert len(frames) >= 89
    times = np.diff([frame.time for frame in frames])
    np.testing.assert_allclose(times, 1 / 30, atol=1e-4)
    if tag != "h":
        names = list(decoder.skeleton.names)
        height = frames[-1].positions[names.index("Head"), 1]
        assert height - frames[-1].positions[names.index("Hips"), 1] == pytest.approx(0.6)
    assert frames[-1].blends == {"Joy": 1.0}


@pytest.mark.parametrize("tag", [None, "d", "i"])
def test_vrchat_trackers_in_any_numbers_are_seen(tag: str | None) -> None:
    decoder, frames = VrchatDecoder(), []
    places = {"head": (0, 2, 0), "1": (0, 1, 0), "2": (-1, 0, 0), "3": (1, 0, 0)}
    for number in range(10):
        for which, place in places.items():
            for kind, values in (("position", place), ("rotation", (0, 0, 0))):
                builder = OscMessageBuilder(f"/tracking/trackers/{which}/{kind}")
                for value in values:
                    builder.add_arg(float(value) if tag == "d" else value, tag)
                frames += decoder.feed(builder.build().dgram, number / 30)
    assert decoder.refused == 0
    seen = {JOINTS[joint] for joint in np.flatnonzero(frames[-1].confidence)}
    assert seen == {"Head", "Hips", "LeftFoot", "RightFoot"}


def test_text_is_no_number() -> None:
    decoder = VmcDecoder()
    decoder.feed(message("/VMC/Ext/Bone/Pos", "Hips", "0", "1", "0", "0", "0", "0", "1"), 0.0)
    assert decoder.refused == 1
