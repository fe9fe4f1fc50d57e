"""Packets with random damage: no exception, no stall, no memory that grows.

CI sends some thousands to each decoder; ``BUNRAKU_MUTATIONS=200000 pytest`` with this file sends
as many as the project's promise names.
"""

from __future__ import annotations

import os
import random
import tracemalloc
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.kinect.joints import KINECT_V2
from devices.osc.nimate import NimateDecoder
from devices.osc.openni_joints import OPENNI
from devices.osc.vmc_decoder import PERFORMER, VmcDecoder
from devices.osc.vrchat import VrchatDecoder
from devices.suits.rokoko import RokokoDecoder
from devices.suits.xsens import XsensDecoder
from devices.suits.xsens_segments import xsens_skeleton
from devices.transport.senders import Decoder
from tests.devices import sender_packets as studio
from tests.devices.vmc_sender import at, bones, bundle, message, ok, root, slime

MUTATIONS = int(os.environ.get("BUNRAKU_MUTATIONS", "1000"))
TRACED = 1000
STEP = 1 / 250
TURN = {"Hips": Rotation.from_euler("x", 0.3)}
POSE = (0.1, 1.0, 0.2, 0.0, 0.0, 0.0, 1.0)


def vmc_packets() -> list[bytes]:
    expressions = [message("/VMC/Ext/Blend/Val", f"face{n}", 0.5) for n in range(5)]
    return [
        slime(1.0, TURN),
        bundle([root(), *bones(TURN)[:17]]),
        bundle([*bones(TURN)[40:], ok(1, 3, 0, 1), at(1.1)]),
        bundle([*expressions, message("/VMC/Ext/Blend/Apply")]),
        bones()[0].dgram,
        at(1.2).dgram,
    ]


def tracker_packets() -> list[bytes]:
    devices = ("Hmd", "Con", "Tra")
    said = [message(f"/VMC/Ext/{one}/Pos", f"LeftFoot {one}", *POSE) for one in devices]
    return [bundle([at(1.0), *said]), *(one.dgram for one in said), bundle(bones(TURN)[30:36])]


def vrchat_packets() -> list[bytes]:
    said = [
        message(f"/tracking/trackers/{which}/{what}", 0.1, 1.0, 0.2)
        for which in ("head", *range(1, 9))
        for what in ("position", "rotation")
    ]
    return [bundle(said), *(one.dgram for one in said)]


def rokoko_packets() -> list[bytes]:
    actors = {name: studio.bones(studio.posed(studio.ROKOKO) + n) for n, name in enumerate("ABC")}
    one = {"A": actors["A"]}
    scenes = [studio.rokoko_v3(one, 1.0), studio.rokoko_v3(actors, 1.1), studio.rokoko_v2(one, 1.2)]
    return [*map(studio.packed, scenes), studio.plain(scenes[0]), studio.plain(scenes[2])]


def xsens_packets() -> list[bytes]:
    places = studio.posed(studio.XSENS)
    gloves = studio.posed(xsens_skeleton(fingers=True))
    return [
        *(studio.mxtp02(places, counter=k, time_ms=17 * k)[0] for k in (1000, 1001, 70_000)),
        *studio.mxtp02(gloves, counter=1002, parts=2, who=3),
        studio.mxtp01(places, counter=1003),
        studio.mxtp13(),
    ]


def nimate_packets() -> list[bytes]:
    places = studio.posed(OPENNI) + np.array([0.0, 0.0, -2.0])
    kinect = studio.posed(KINECT_V2)
    return [
        bundle(studio.osceleton(places, 1)),
        bundle(studio.nimate(places, user=2)),
        bundle([*studio.nimate(places, shape="/{name}_{user}", user=3), studio.SYNC]),
        bundle(studio.nimate(places, what="turn", user=4)),
        bundle(studio.animata(places, 5)),
        bundle(studio.kinect2(kinect)),
        studio.skelecaster({7: kinect, 8: kinect + 1.0}),
        message("skeleton", *([0.5, 1.0, 2.0] * 15)).dgram,
        bundle([message("/lost_user", 1)]),
        *(one.dgram for one in studio.nimate(places)[:4]),
    ]


def kinect_packets() -> list[bytes]:
    said = studio.kinect2(studio.posed(KINECT_V2))
    return [bundle(said), bundle(said[:9]), *(one.dgram for one in said)]


def skelecaster_packets() -> list[bytes]:
    kinect = studio.posed(KINECT_V2)
    return [studio.skelecaster({n: kinect + n for n in range(k)}) for k in (1, 2, 6, 0)]


DECODERS: dict[str, tuple[Callable[[], Decoder], Callable[[], list[bytes]]]] = {
    "vmc": (VmcDecoder, vmc_packets),
    "vmc performer": (lambda: VmcDecoder(PERFORMER), tracker_packets),
    "vrchat": (VrchatDecoder, vrchat_packets),
    "nimate": (NimateDecoder, nimate_packets),
    "nimate kinect2": (lambda: NimateDecoder("kinect2"), kinect_packets),
    "nimate skelecaster": (lambda: NimateDecoder("skelecaster"), skelecaster_packets),
    "rokoko": (RokokoDecoder, rokoko_packets),
    "xsens": (XsensDecoder, xsens_packets),
    "xsens gloves": (lambda: XsensDecoder(fingers=True), xsens_packets),
}
"""What each protocol's decoder is, and good packets to damage."""


def damaged(chance: random.Random, packets: Sequence[bytes]) -> bytes:
    """A packet with some bytes changed, cut out, repeated or joined to another's."""
    data = bytearray(chance.choice(packets))
    for _ in range(chance.choice((0, 1, 1, 2, 8))):
        kind, place = chance.randrange(6), chance.randrange(len(data) + 1)
        if kind <= 1 and place < len(data):
            data[place] = chance.randrange(256)
        elif kind == 2:
            data[place : place + 4] = chance.choice((b"\xff" * 4, bytes(4), b"\x7f\xc0\0\0"))
        elif kind == 3:
            del data[place : place + chance.choice((1, 4, 16))]
        elif kind == 4:
            data[place:place] = data[place : place + chance.choice((4, 40))]
        else:
            data = data[:place] + bytearray(chance.choice(packets))[place:]
    return bytes(data[:65535])


@pytest.mark.parametrize("name", DECODERS)
def test_damaged_packets_do_no_harm(name: str) -> None:
    make, good = DECODERS[name]
    decoder, packets = make(), good()
    chance = random.Random(name)

    def feed(numbers: range) -> int:
        frames = 0
        for number in numbers:
            for frame in decoder.feed(damaged(chance, packets), 100.0 + number * STEP):
                frames += 1
                known = ~np.isnan(frame.positions[:, 0])
                assert frame.positions.shape == (len(decoder.skeleton.names), 3)
                assert np.isfinite(frame.positions[known]).all()
                assert (known == (frame.confidence > 0.0)).all()
                assert frame.time <= frame.arrival
        return frames

    assert feed(range(MUTATIONS)) > 0
    assert decoder.refused > 0
    tracemalloc.start()
    try:
        feed(range(MUTATIONS, MUTATIONS + TRACED))
        grown = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert grown < 200 * TRACED  # bytes
    again = [f for k in range(30) for f in decoder.feed(packets[0], 1e6 + k * 0.1)]
    assert len(again) > 0  # it still hears a sender that means well
