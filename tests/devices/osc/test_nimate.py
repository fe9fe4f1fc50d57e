"""NI mate's joints: whole frames, users and numbers, lost joints, and hostile messages."""

from __future__ import annotations

import socket

import numpy as np
import pytest
from pythonosc.osc_message import OscMessage
from pythonosc.udp_client import SimpleUDPClient
from scipy.spatial.transform import Rotation

from devices.bodies.source_joints import available_presets
from devices.errors import InputError
from devices.kinect.joints import KINECT_V2
from devices.osc.nimate import INFERRED, MOST_USERS, NimateDecoder
from devices.osc.openni_joints import OPENNI
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.transport.live_stream import LiveStream
from tests.devices.osc.nimate_bodies import (
    FAR,
    TURNS,
    WAYS,
    body,
    fed,
    joint,
    kinect_body,
    standing,
)
from tests.devices.sender_packets import NIMATE, STEP, SYNC, animata, nimate, osceleton, skelecaster
from tests.devices.vmc_sender import built, bundle, message
from tests.waiting import PATIENCE


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("bundled", [True, False], ids=["bundles", "bare"])
def test_every_way_to_say_it_is_the_same_body(way: str, bundled: bool) -> None:
    frames = fed(NimateDecoder(), [WAYS[way](body(k) + FAR) for k in range(6)], bundled=bundled)
    assert len(frames) >= 5
    for frame, k in zip(frames, range(6), strict=False):
        wanted = standing(body(k) + FAR)
        assert frame.positions[:, 1] == pytest.approx(wanted[:, 1], abs=2e-3)
        assert frame.positions == pytest.approx(wanted, abs=2e-3)
        assert (frame.confidence == 1.0).all()
        assert frame.performer == 0
        assert frame.time == frame.arrival


def test_left_stays_left_and_faces_forward() -> None:
    for say in WAYS.values():
        frame = fed(NimateDecoder(), [say(OPENNI.rest_positions + FAR)] * 3)[-1]
        at = dict(zip(OPENNI.names, frame.positions, strict=True))
        left, up = at["LeftHand"] - at["RightHand"], at["Head"] - at["Pelvis"]
        assert left[0] > 1.0
        assert up[1] > 0.5
        assert at["LeftKnee"][2] > at["LeftFoot"][2]  # a knee is before the ankle
        forward = at["LeftKnee"] - at["LeftFoot"]
        assert np.linalg.det([left, up, forward]) > 0.0
        assert frame.positions[:, 1].min() == pytest.approx(0.0, abs=1e-6)


def test_orientations_are_joint_to_world() -> None:
    frame = fed(NimateDecoder(), [nimate(body(k) + FAR, TURNS) for k in range(3)])[-1]
    assert frame.rotations is not None
    told = [joint(name) for name in NIMATE]
    errors = (Rotation.from_quat(frame.rotations[told]) * TURNS[told].inv()).magnitude()
    assert errors.max() < 1e-5


def test_orientations_alone_go_through_forward_kinematics() -> None:
    turns = {"LeftShoulder": Rotation.from_euler("z", 1.0), "LeftElbow": Rotation.identity()}
    rotations = Rotation.concatenate([turns.get(n, Rotation.identity()) for n in OPENNI.names])
    rest = OPENNI.rest_positions.copy()
    said = [nimate(rest, rotations, what="turn", user=k // 3) for k in range(3)]
    frame = fed(NimateDecoder(), said)[-1]
    upper = rest[joint("LeftElbow")] - rest[joint("LeftShoulder")]
    elbow = rest[joint("LeftShoulder")] + turns["LeftShoulder"].apply(upper)
    hand = elbow + rest[joint("LeftHand")] - rest[joint("LeftElbow")]
    assert frame.positions[joint("LeftElbow")] == pytest.approx(elbow, abs=1e-6)
    assert frame.positions[joint("LeftHand")] == pytest.approx(hand, abs=1e-6)
    assert frame.positions[joint("RightFoot")] == pytest.approx(rest[joint("RightFoot")], abs=1e-6)
    assert frame.confidence[joint("LeftHand")] == 1.0
    assert frame.confidence[joint("Pelvis")] == INFERRED


def test_the_mark_ends_a_frame_and_nothing_else_does() -> None:
    decoder = NimateDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(10):
        said = nimate(body(k) + FAR, what="place")
        at = 10.0 + k * STEP
        frames += decoder.feed(bundle(said[:7]), at)
        frames += decoder.feed(bundle(said[7 if k % 2 else 8 :]), at + 0.0005)
        assert len(frames) == k
        frames += decoder.feed(SYNC.dgram, at + 0.001)
        assert len(frames) == k + 1
    seen = [int(np.count_nonzero(frame.confidence)) for frame in frames]
    assert set(seen) == {15, 16}
    assert decoder.refused == 0


def test_a_mark_without_a_slash_and_one_that_was_lost() -> None:
    decoder = NimateDecoder()
    mark = message("NI_mate_sync", 1)
    frames = [
        frame
        for k in range(20)
        for said in (nimate(body(k) + FAR, what="place"), [mark] if k % 5 else [])
        for frame in (decoder.feed(bundle(said), 10.0 + k * STEP) if said else ())
    ]
    assert len(frames) == 20
    assert all((frame.confidence == 1.0).all() for frame in frames)


@pytest.mark.parametrize(
    "shape", ["{name}_{user}", "/{user}/{name}", "/user{user}/{name}", "{name}"]
)
def test_user_ids_in_addresses_and_arguments(shape: str) -> None:
    said = [
        [
            *nimate(body(k) + FAR, shape=shape, user=4),
            *nimate(body(k) + FAR + (1.5, 0.0, 0.0), shape=shape, user=9),
        ]
        for k in range(5)
    ]
    frames = fed(NimateDecoder(), said)
    assert [frame.performer for frame in frames] == [0, 1] * 5
    apart = frames[-1].positions - frames[-2].positions
    assert apart == pytest.approx(np.tile([1.5, 0.0, 0.0], (16, 1)), abs=0.01)


def test_users_keep_their_numbers_and_the_lost_are_forgotten() -> None:
    decoder = NimateDecoder()
    two = [[*osceleton(body(k) + FAR, 1), *osceleton(body(k) + FAR + 1, 2)] for k in range(5)]
    frames = fed(decoder, two)
    assert [frame.performer for frame in frames] == [0, 1] * 5
    decoder.feed(bundle([message("/lost_user", 1)]), 10.2)
    later: list[SkeletonFrame] = []
    for k in range(5):
        data = bundle([*osceleton(body(k) + FAR + 1, 2), *osceleton(body(k) + FAR, 7)])
        later += decoder.feed(data, 10.3 + k * STEP)
    assert {frame.performer for frame in later} == {0, 1}
    assert later[-1].performer == 0 or later[-2].performer == 0
    other = next(f for f in later[::-1] if f.performer == 1)
    assert other.positions[0, 0] == pytest.approx(standing(body(4) + FAR + 1)[0, 0], abs=0.02)


def test_no_more_users_than_there_are_places_for() -> None:
    decoder = NimateDecoder()
    for user in range(1000):
        decoder.feed(bundle(osceleton(body() + FAR, user)), 10.0 + user * 1e-3)
    assert len(decoder._users) == MOST_USERS
    assert decoder.refused >= 1000 - 2 * MOST_USERS
    frames = [
        f for k in range(3) for f in decoder.feed(bundle(osceleton(body(k) + FAR)), 30.0 + k * STEP)
    ]
    (performer,) = {frame.performer for frame in frames}
    assert performer < MOST_USERS


def test_joints_that_are_not_told_are_not_seen() -> None:
    said = [osceleton(body(k) + FAR) for k in range(6)]
    said[3] = said[3][:9]
    frames = fed(NimateDecoder(), said)
    partial = [frame for frame in frames if not (frame.confidence == 1.0).all()]
    assert len(partial) == 1
    assert np.isnan(partial[0].positions[partial[0].confidence == 0.0]).all()


@pytest.mark.parametrize("lost", [1, 10, 300])
def test_a_hand_that_is_lost_for_a_while_holds_nothing_up(lost: int) -> None:
    said = [osceleton(body(k % 50) + FAR) for k in range(lost + 40)]
    for k in range(20, 20 + lost):
        said[k] = [one for one in said[k] if one.params[0] != "l_hand"]
    decoder = NimateDecoder()
    frames = fed(decoder, said)
    gone = [bool(frame.confidence[joint("LeftHand")] == 0.0) for frame in frames]
    assert len(frames) == len(said)
    assert sum(gone) == lost
    assert not gone[-1]
    assert decoder.refused == 0


def test_a_future_timetag_waits_for_nobody() -> None:
    decoder = NimateDecoder()
    late = [bundle(osceleton(body(k) + FAR), timetag=2e9) for k in range(3)]
    assert sum(len(decoder.feed(data, 1.0 + k * STEP)) for k, data in enumerate(late)) == 3


def test_a_datagram_that_comes_twice_is_one() -> None:
    decoder = NimateDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(10):
        for one in osceleton(body(k) + FAR):
            for copy in (0.0, 1e-4):
                frames += decoder.feed(one.dgram, 10.0 + k * STEP + copy)
    assert len(frames) >= 9
    assert all((frame.confidence == 1.0).all() for frame in frames)
    assert decoder.refused == 10 * 15


def test_a_joint_that_comes_again_after_others_ends_no_frame() -> None:
    decoder = NimateDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(10):
        said = osceleton(body(k) + FAR)
        for n, one in enumerate([*said[:5], said[2], *said[5:9], said[0], *said[9:]]):
            frames += decoder.feed(one.dgram, 10.0 + k * STEP + n * 1e-5)
    assert len(frames) >= 9
    assert all((frame.confidence == 1.0).all() for frame in frames)
    assert decoder.refused == 20


EVIL = [
    "@__import__('os').abort()",
    "?raise SystemExit",
    "/@exit()",
    "@bpy.ops.wm.quit_blender()",
]


@pytest.mark.parametrize("address", EVIL)
def test_nothing_is_evaluated(address: str) -> None:
    decoder = NimateDecoder()
    for values in ((), (1.0, 2.0, 3.0), (1.0,) * 7, ("x",)):
        assert decoder.feed(message(address, *values).dgram, 1.0) == []


BAD = [
    message("Left_Hand", 1.0, 2.0),
    message("Left_Hand", 1.0, 2.0, 3.0, 4.0, 5.0),
    message("Left_Hand", "a", 1.0, 2.0, 3.0),
    message("Left_Hand", 1, 2, 3),
    message("Left_Hand", float("nan"), 0.0, 0.0),
    message("Left_Hand", float("inf"), 0.0, 0.0),
    message("Left_Hand", 1e30, 0.0, 0.0),
    message("/joint", 1, 1.0, 2.0, 3.0),
    message("/joint", "l_hand"),
    message("/joint", "l_hand", 1, 1.0),
    message("/joint", "l_hand", 1, float("nan"), 0.0, 0.0),
    message("/bodies/5/joints/HandLeft", 1.0, 2.0),
    message("/bodies/5/joints/HandLeft", "a", "b", "c"),
    message("skeleton", *[1.0] * 44),
    message("skeleton", *[1.0] * 12),
]


@pytest.mark.parametrize("bad", BAD, ids=lambda one: f"{one.address} {one.params}"[:40])
def test_malformed_messages_are_left_out_and_counted(bad: OscMessage) -> None:
    decoder = NimateDecoder()
    said = [[bad, *nimate(body(k) + FAR)] for k in range(3)]
    frames = fed(decoder, said)
    assert decoder.refused == 3
    assert all((frame.confidence == 1.0).all() for frame in frames)
    assert len(frames) >= 2


@pytest.mark.parametrize(
    "other",
    [
        message("/hello_world", 1.0, 2.0, 3.0),
        message("/joint", "tail", 1, 0.5, 0.5, 2.0),
        message("/new_user", 1),
        message("/new_skel", 1),
        message("/user/1", 0.5, 0.5, 2.0),
        message("/orient/l_knee/1", *[1.0] * 9),
        message("Left_Hand", 0.0, 0.0, 0.0, 0.0),
        message("/" + "x" * 5000, 1.0, 2.0, 3.0),
        message("/bodies/5/joints/Tail", 1.0, 2.0, 3.0),
    ],
    ids=lambda one: str(one.address)[:30],
)
def test_other_messages_are_no_fault(other: OscMessage) -> None:
    decoder = NimateDecoder()
    fed(decoder, [[other, *osceleton(body(k) + FAR)] for k in range(3)])
    assert decoder.refused == 0


def test_a_frame_without_a_torso_or_a_body_flat_as_a_point() -> None:
    for places in (np.zeros((16, 3)), np.full((16, 3), 1e-9), body() * 1e4):
        for say in (nimate, osceleton, animata):
            frames = fed(NimateDecoder(), [say(places + k * 1e-3) for k in range(3)])
            for frame in frames:
                seen = frame.confidence > 0.0
                assert np.isfinite(frame.positions[seen]).all()
                assert np.isnan(frame.positions[~seen]).all()
    only = [one for one in osceleton(body() + FAR) if one.params[0] in ("l_hand", "l_elbow")]
    frames = fed(NimateDecoder(), [only, only, only])
    assert all(np.count_nonzero(frame.confidence) == 2 for frame in frames)


def test_the_presets_work() -> None:
    wanted = {"whole", "upper", "arms", "legs", "left-arm", "right-arm", "right-leg", "spine"}
    assert wanted <= set(available_presets(OPENNI))
    assert wanted <= set(available_presets(NimateDecoder("kinect2").skeleton))


def test_through_a_socket_from_python_osc_s_own_client() -> None:
    with open_stream("nimate://127.0.0.1:0") as stream:
        assert isinstance(stream, LiveStream)
        port: int = stream.transport.port
        with SimpleUDPClient("127.0.0.1", port) as client:
            client.send(built([*nimate(body() + FAR, what="place"), SYNC]))
        assert stream.wait(PATIENCE)
        (frame,) = stream.poll()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(skelecaster({1: kinect_body()}), ("127.0.0.1", port))
        assert stream.wait(PATIENCE)
    assert frame.positions == pytest.approx(standing(body() + FAR), abs=2e-3)


def test_addresses() -> None:
    with open_stream("nimate://127.0.0.1:0?format=kinect2") as stream:
        assert stream.skeleton is KINECT_V2
    with open_stream("nimate://127.0.0.1:0?format=nimate&scale=0.1&joints=head,neck,l_hand"):
        pass
    for query, why in (
        ("format=tarot", "osceleton"),
        ("scale=-1", "above 0"),
        ("joints=head,tail", "names of different joints"),
        ("joints=head,head", "names of different joints"),
    ):
        with pytest.raises(InputError, match=why):
            open_stream(f"nimate://127.0.0.1:0?{query}")
