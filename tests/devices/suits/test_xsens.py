"""MXTP as its specification writes it: segments in place, samples whole, nothing guessed."""

from __future__ import annotations

import socket
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.source_joints import available_presets
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.suits.xsens import LATE, MOST_CHARACTERS, MOST_OPEN, XsensDecoder
from devices.suits.xsens_segments import xsens_skeleton
from devices.transport.live_stream import LiveStream
from tests.devices.sender_packets import MVN_Y_UP, STEP, XSENS, mxtp01, mxtp02, mxtp13, posed
from tests.waiting import PATIENCE

GLOVES = xsens_skeleton(fingers=True)
TURNS = Rotation.from_euler("yx", np.linspace(0.1, 1.0, 46).reshape(23, 2))


def joint(name: str) -> int:
    return XSENS.index(name)


def fed(decoder: XsensDecoder, *datagrams: bytes, start: float = 10.0) -> list[SkeletonFrame]:
    return [f for n, data in enumerate(datagrams) for f in decoder.feed(data, start + n * STEP)]


def test_the_golden_packet_has_760_bytes_and_one_body() -> None:
    places = posed(XSENS)
    (data,) = mxtp02(places, TURNS, counter=7, time_ms=5000)
    assert len(data) == 760
    decoder = XsensDecoder()
    (frame,) = decoder.feed(data, 50.0)
    assert frame.positions == pytest.approx(places, abs=1e-5)
    assert frame.rotations is not None
    assert (Rotation.from_quat(frame.rotations) * TURNS.inv()).magnitude().max() < 1e-5
    assert (frame.confidence == 1.0).all()
    assert (frame.performer, frame.arrival, frame.time) == (0, 50.0, 50.0)
    assert decoder.refused == 0


def test_bytes_written_out_by_hand() -> None:
    item = bytes.fromhex("00000001 3f800000 40000000 40400000 3f800000 00000000 00000000 00000000")
    head = bytes.fromhex("4d5854503032 00000001 80 01 000003e8 00 17 00 00 0000 0020")
    (frame,) = XsensDecoder().feed(head + item, 1.0)
    assert frame.positions[joint("Pelvis")] == pytest.approx((2.0, 3.0, 1.0))  # left, up, forward
    assert frame.rotations is not None
    assert frame.rotations[joint("Pelvis")] == pytest.approx((0.0, 0.0, 0.0, 1.0))
    assert np.count_nonzero(frame.confidence) == 1
    assert np.isnan(frame.positions[1:]).all()


def test_left_stays_left_and_faces_forward() -> None:
    (frame,) = XsensDecoder().feed(mxtp02(XSENS.rest_positions)[0], 1.0)
    at = dict(zip(XSENS.names, frame.positions, strict=True))
    left, up = at["LeftHand"] - at["RightHand"], at["Head"] - at["Pelvis"]
    forward = at["LeftToe"] - at["LeftFoot"]
    assert left[0] > 1.0
    assert up[1] > 0.5
    assert forward[2] > 0.1
    assert np.linalg.det([left, up, forward]) > 0.0


def test_y_may_be_up() -> None:
    places = posed(XSENS)
    decoder = XsensDecoder(up="y")
    (frame,) = decoder.feed(mxtp02(places, TURNS, axes=MVN_Y_UP)[0], 1.0)
    assert frame.positions == pytest.approx(places, abs=1e-5)
    assert frame.rotations is not None
    assert (Rotation.from_quat(frame.rotations) * TURNS.inv()).magnitude().max() < 1e-5


@pytest.mark.parametrize("part", [slice(0, 23), slice(15, 23), slice(4, 15)])
def test_some_versions_send_centimetres(part: slice) -> None:
    places, ids = posed(XSENS)[part], range(1, 24)[part]
    for unit in (1.0, 100.0):
        (frame,) = XsensDecoder().feed(mxtp02(unit * (places + 4.0), ids=ids)[0], 1.0)
        assert frame.positions[part] == pytest.approx(places + 4.0, abs=1e-3)
        assert np.count_nonzero(frame.confidence) == len(places)


def test_euler_angles_bring_positions_only() -> None:
    places = posed(XSENS)
    (frame,) = XsensDecoder().feed(mxtp01(places), 1.0)
    assert frame.positions == pytest.approx(places, abs=1e-4)
    assert frame.rotations is not None
    assert np.isnan(frame.rotations).all()


def test_of_both_kinds_at_once_the_fuller_is_taken() -> None:
    decoder = XsensDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(5):
        for data in (mxtp02(posed(XSENS, k), counter=k)[0], mxtp01(posed(XSENS, k), counter=k)):
            frames += decoder.feed(data, 1.0 + k * STEP)
    assert len(frames) == 5
    assert all(f.rotations is not None and np.isfinite(f.rotations).all() for f in frames)
    assert decoder.refused == 0


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_a_sample_in_three_datagrams_is_put_together_in_any_order(order: tuple[int, ...]) -> None:
    places = posed(GLOVES)
    parts = mxtp02(places, parts=3)
    assert [data[10] for data in parts] == [0, 1, 0x82]
    decoder = XsensDecoder(fingers=True)
    frames = fed(decoder, *(parts[n] for n in order))
    assert len(frames) == 1
    assert frames[0].positions == pytest.approx(places, abs=1e-5)
    assert decoder.refused == 0


def test_a_sample_that_lost_a_datagram_is_left_out_and_counted() -> None:
    decoder = XsensDecoder()
    lost = mxtp02(posed(XSENS), counter=1, parts=2)[:1]
    whole = mxtp02(posed(XSENS, 1), counter=2, parts=2)
    assert len(fed(decoder, *lost, *whole)) == 1
    assert decoder.refused == 1
    for counter in range(3, 30):
        fed(decoder, mxtp02(posed(XSENS), counter=counter, parts=2)[0])
    assert len(decoder._characters[0].open) <= MOST_OPEN + 1


def test_props_have_no_joint_and_fingers_come_after_them() -> None:
    held = np.vstack(
        [GLOVES.rest_positions[:23], [[5.0, 5.0, 5.0]] * 2, GLOVES.rest_positions[23:]]
    )
    (data,) = mxtp02(held, props=2)
    (frame,) = XsensDecoder(fingers=True).feed(data, 1.0)
    assert frame.positions == pytest.approx(GLOVES.rest_positions, abs=1e-5)
    (body,) = XsensDecoder().feed(data, 1.0)
    assert body.positions == pytest.approx(XSENS.rest_positions, abs=1e-5)


def test_characters_are_performers_of_their_own() -> None:
    decoder = XsensDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(10):
        for who in (0, 3):
            frames += decoder.feed(mxtp02(posed(XSENS) + who, counter=k, who=who)[0], k * STEP)
    assert [frame.performer for frame in frames] == [0, 3] * 10
    assert frames[-1].positions == pytest.approx(posed(XSENS) + 3, abs=1e-5)
    assert decoder.refused == 0


def test_repeated_and_overtaken_samples_are_left_out() -> None:
    decoder = XsensDecoder()
    at = [mxtp02(posed(XSENS, k), counter=k, time_ms=17 * k)[0] for k in range(6)]
    frames = fed(decoder, at[0], at[1], at[1], at[3], at[2], at[4], at[0], at[5])
    heights = [float(f.positions[joint("LeftHand"), 1]) for f in frames]
    assert heights == pytest.approx(
        [float(posed(XSENS, k)[joint("LeftHand"), 1]) for k in (0, 1, 3, 4, 5)], abs=1e-5
    )
    assert decoder.refused == 3


@pytest.mark.parametrize("began", [100, 5000, 4_294_967_295])
def test_a_sender_that_starts_again_is_heard_at_once(began: int) -> None:
    decoder = XsensDecoder()
    fed(decoder, mxtp02(posed(XSENS), counter=began, time_ms=90_000)[0], start=10.0)
    pause = 0.0 if began > LATE else 1.0
    frames: list[SkeletonFrame] = []
    for k in range(60):
        data = mxtp02(posed(XSENS, k), counter=k, time_ms=17 * k)[0]
        frames += decoder.feed(data, 10.02 + pause + k / 60)
    assert len(frames) == 60
    assert all(frame.time <= frame.arrival for frame in frames)
    assert np.diff([frame.time for frame in frames]).min() >= 0.0
    assert frames[-1].time == pytest.approx(frames[-1].arrival, abs=0.02)


def test_the_clock_is_mvn_s_own() -> None:
    decoder = XsensDecoder()
    late = np.random.default_rng(1).exponential(0.003, 200)
    frames = [
        f
        for k in range(200)
        for f in decoder.feed(
            mxtp02(posed(XSENS), counter=k, time_ms=k * 10)[0], 5.0 + 0.01 * k + late[k]
        )
    ]
    steps = np.diff([frame.time for frame in frames[50:]])
    assert steps == pytest.approx(0.01, abs=1e-3)


def test_what_holds_no_pose_is_no_fault() -> None:
    decoder = XsensDecoder()
    assert fed(decoder, mxtp13(), b"MXTP25" + mxtp13()[6:]) == []
    assert decoder.refused == 0


def _damaged(**changes: object) -> bytes:
    (data,) = mxtp02(posed(XSENS))
    edited = bytearray(data)
    for place, value in changes.items():
        assert isinstance(value, bytes)
        start = int(place[1:])
        edited[start : start + len(value)] = value
    return bytes(edited)


HOSTILE = {
    "nothing": b"",
    "a header alone": mxtp02(posed(XSENS))[0][:24],
    "half a header": mxtp02(posed(XSENS))[0][:12],
    "cut short": mxtp02(posed(XSENS))[0][:-1],
    "a byte too many": mxtp02(posed(XSENS))[0] + b"\0",
    "no segments": _damaged(_11=b"\0"),
    "more segments than there are": _damaged(_11=b"\xff"),
    "another size": _damaged(_22=b"\0\1"),
    "the hundredth datagram": _damaged(_10=b"\x64"),
    "too high a character": _damaged(_16=bytes([MOST_CHARACTERS])),
    "an unknown kind": _damaged(_0=b"MXTP99"),
    "Unity's kind": _damaged(_0=b"MXTP05"),
    "another protocol": _damaged(_0=b"/VMC/E"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_malformed_datagrams_are_left_out_and_counted(name: str) -> None:
    decoder = XsensDecoder()
    assert decoder.feed(HOSTILE[name], 1.0) == ()
    assert decoder.refused == 1
    assert len(fed(decoder, mxtp02(posed(XSENS), counter=1)[0])) == 1


def test_what_no_body_can_have_is_not_seen() -> None:
    places = posed(XSENS)
    data = bytearray(mxtp02(places)[0])
    for segment, value in enumerate([np.nan, np.inf, -np.inf, 1e30], 1):
        struct.pack_into(">f", data, 24 + 32 * segment + 4, value)
    struct.pack_into(">4f", data, 24 + 16, 0.0, 0.0, 0.0, 0.0)
    struct.pack_into(">I", data, 24 + 32 * joint("Head"), 200)
    (frame,) = XsensDecoder().feed(bytes(data), 1.0)
    assert np.isnan(frame.positions[1:5]).all()
    assert np.isnan(frame.positions[joint("Head")]).all()  # no segment is 200
    assert frame.confidence.tolist() == [1.0, *[0.0] * 4, 1.0, 0.0, *[1.0] * 16]
    assert frame.rotations is not None
    assert np.isnan(frame.rotations[:5]).all()
    assert frame.positions[0] == pytest.approx(places[0], abs=1e-5)


def test_the_presets_work() -> None:
    wanted = {"whole", "upper", "arms", "legs", "left-arm", "right-arm", "left-leg", "spine"}
    assert wanted <= set(available_presets(XSENS))
    assert wanted | {"left-hand", "right-hand"} <= set(available_presets(GLOVES))
    assert GLOVES.names[:23] == XSENS.names


def test_through_a_socket() -> None:
    with open_stream("xsens://127.0.0.1:0?fingers=on&up=z") as stream:
        assert isinstance(stream, LiveStream)
        assert stream.skeleton.names == GLOVES.names
        assert stream.skeleton.rest_positions == pytest.approx(GLOVES.rest_positions)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for data in mxtp02(posed(GLOVES), parts=2):
                sender.sendto(data, ("127.0.0.1", stream.transport.port))
        assert stream.wait(PATIENCE)
        (frame,) = stream.poll()
    assert frame.positions == pytest.approx(posed(GLOVES), abs=1e-5)
