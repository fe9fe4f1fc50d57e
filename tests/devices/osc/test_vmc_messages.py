"""Single VMC messages: wrong, unknown and late ones, trackers, presets, addresses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.humanoid import SIDES, humanoid_skeleton
from devices.bodies.source_joints import available_presets, source_joints
from devices.errors import InputError
from devices.osc.vmc_decoder import PERFORMER, VmcDecoder
from devices.osc.vmc_trackers import bone_of_tracker
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.transport.live_stream import LiveStream
from tests.devices.osc.vmc_frames import REST, STEP, fed, joint
from tests.devices.vmc_sender import HUMAN, at, bones, bundle, local_offsets, message

POSE = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    "bad",
    [
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:6]),
        message("/VMC/Ext/Bone/Pos", "Hips", *"1000001"),
        message("/VMC/Ext/Bone/Pos", 7.0, *POSE),
        message("/VMC/Ext/Bone/Pos", "Hips", math.nan, *POSE[1:]),
        message("/VMC/Ext/Bone/Pos", "Hips", 3e38, *POSE[1:]),
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:3], 0.0, 0.0, 0.0, 0.0),
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:6], math.inf),
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:6], 9.0),
        message("/VMC/Ext/Root/Pos", "root", math.nan, *POSE[1:]),
        message("/VMC/Ext/Root/Pos", "root"),
        message("/VMC/Ext/OK", "1"),
        message("/VMC/Ext/OK"),
        message("/VMC/Ext/T", "1"),
        message("/VMC/Ext/T", math.nan),
        message("/VMC/Ext/Blend/Val", "Joy"),
        message("/VMC/Ext/Blend/Val", "Joy", math.inf),
    ],
    ids=str,
)
def test_what_is_wrong_is_left_out_and_counted_and_the_rest_is_used(bad: object) -> None:
    decoder = VmcDecoder()
    frames = fed(decoder, [(k * STEP, bundle([at(k * STEP), *bones(), bad])) for k in range(3)])
    assert decoder.refused == 3
    assert frames[-1].positions == pytest.approx(REST, abs=1e-6)


@pytest.mark.parametrize(
    "unknown",
    [
        message("/VMC/Ext/Bone/Pos", "LastBone", *POSE),
        message("/VMC/Ext/Bone/Pos", "ThirdArm", *POSE),
        message("/VMC/Ext/Bone/Pos", "hips", *POSE, 1.0, "more"),
        message("/VMC/Ext/Rcv", 1, 39540),
        message("/VMC/Ext/VRM", "C:\\model.vrm", "title"),
        message("/VMC/Thru/anything", "at all", 1.0),
        message("/elsewhere"),
    ],
    ids=str,
)
def test_what_is_not_known_is_no_fault(unknown: object) -> None:
    decoder = VmcDecoder()
    frames = fed(decoder, [(k * STEP, bundle([at(k * STEP), unknown, *bones()])) for k in range(3)])
    assert decoder.refused == 0
    assert frames[-1].positions == pytest.approx(REST, abs=1e-6)


def test_a_future_timetag_waits_for_nobody() -> None:
    decoder = VmcDecoder()
    data = [bundle([at(k * STEP), *bones()], timetag=2e9) for k in range(3)]
    assert len(fed(decoder, [(k * STEP, one) for k, one in enumerate(data)])) == 3


def test_assistants_send_trackers_and_parts_of_bodies_to_a_performer() -> None:
    decoder = VmcDecoder(PERFORMER, trackers={"LHR-7": joint("Hips")})
    fingers = [name for name in HUMAN.names if name.startswith("LeftIndex")]
    turns = {"LeftIndexProximal": Rotation.from_euler("z", -1.0)}
    hand = Rotation.from_euler("y", 0.5)
    place = (0.4, 1.2, 0.3)
    frames: list[SkeletonFrame] = []
    for k in range(4):
        frames += decoder.feed(
            bundle(
                [
                    message("/VMC/Ext/Hmd/Pos", "HMD-1", 0.0, 1.6, 0.1 * k, 0.0, 0.0, 0.0, 1.0),
                    _tracker("/VMC/Ext/Con/Pos", "LeftHand", place, hand),
                    _tracker("/VMC/Ext/Tra/Pos", "LHR-7", (0.0, 0.9, 0.0), Rotation.identity()),
                    message("/VMC/Ext/Tra/Pos", "LHR-99", *POSE),
                    *bones(turns, only=fingers),
                ]
            ),
            k * STEP,
        )
    frame = frames[-1]
    assert frame.positions[joint("Head")] == pytest.approx((0.0, 1.6, 0.3), abs=1e-6)
    assert frame.positions[joint("Hips")] == pytest.approx((0.0, 0.9, 0.0), abs=1e-6)
    assert frame.positions[joint("LeftHand")] == pytest.approx(place, abs=1e-6)
    assert np.isnan(frame.positions[joint("RightHand")]).all()
    assert np.isnan(frame.positions[joint("Spine")]).all()
    # The fingers hang on the tracked hand.
    knuckle = hand.apply(local_offsets()[joint("LeftIndexProximal")]) + place
    assert frame.positions[joint("LeftIndexProximal")] == pytest.approx(knuckle, abs=1e-6)
    bent = hand * turns["LeftIndexProximal"]
    next_one = knuckle + bent.apply(local_offsets()[joint("LeftIndexIntermediate")])
    assert frame.positions[joint("LeftIndexIntermediate")] == pytest.approx(next_one, abs=1e-6)
    assert frame.confidence[joint("LeftHand")] == 1.0
    marionette = VmcDecoder()
    assert fed(marionette, [(k * STEP, _hmd(k)) for k in range(5)]) == []


def _tracker(address: str, serial: str, place: Sequence[float], turn: Rotation) -> object:
    mirror = np.diag([-1.0, 1.0, 1.0])
    quaternion = Rotation.from_matrix(mirror @ turn.as_matrix() @ mirror).as_quat()
    return message(address, serial, *(mirror @ np.array(place)).tolist(), *quaternion.tolist())


def _hmd(k: int) -> bytes:
    return message("/VMC/Ext/Hmd/Pos", "HMD", 0.0, 1.6, 0.1 * k, 0.0, 0.0, 0.0, 1.0).dgram


def test_trackers_are_told_by_their_names() -> None:
    assert bone_of_tracker("waist") == joint("Spine")
    assert bone_of_tracker("Left Foot") == joint("LeftFoot")
    assert bone_of_tracker("tracker_right_knee") == joint("RightLowerLeg")
    assert bone_of_tracker("LHR-1A2B3C4D") is None
    assert bone_of_tracker("x" * 100_000) is None


def test_the_presets_work_on_a_humanoid() -> None:
    skeleton = humanoid_skeleton()
    wanted = {"whole", "upper", "arms", "legs", "left-arm", "right-leg", "left-hand", "spine"}
    assert wanted <= set(available_presets(skeleton))
    names = [skeleton.names[j] for j in source_joints(skeleton, "left-hand")]
    assert names[0] == "LeftHand"
    assert len(names) == 16
    for name in skeleton.names:
        for side, other in (SIDES, SIDES[::-1]):
            if name.startswith(side):
                mirrored = skeleton.rest_positions[skeleton.index(name.replace(side, other))]
                here = skeleton.rest_positions[skeleton.index(name)]
                assert here == pytest.approx(mirrored * (-1.0, 1.0, 1.0))
                assert (here[0] > 0) == (side == "Left")


def test_addresses() -> None:
    with open_stream("vmc://127.0.0.1:0?tpose=2") as stream:
        assert isinstance(stream, LiveStream)
        assert stream.skeleton is HUMAN
    with open_stream("vmc://127.0.0.1:0?role=performer&trackers=LHR-7:Hips,a:b:LeftFoot"):
        pass
    for query, why in (
        ("role=assistant", "marionette or performer"),
        ("trackers=LHR-7:Hips", "role=performer"),
        ("role=performer&trackers=LHR-7", "SERIAL:BONE"),
        ("role=performer&trackers=LHR-7:Tail", "SERIAL:BONE"),
        ("role=performer&tpose=1", "no T-pose"),
        ("tpose=-1", "above 0"),
    ):
        with pytest.raises(InputError, match=why):
            open_stream(f"vmc://127.0.0.1:0?{query}")
