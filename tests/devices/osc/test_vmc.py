"""VMC as independent senders write it: frames whole, joints in place, nothing guessed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.humanoid import FINGERS, SEGMENTS, SIDES, humanoid_skeleton
from devices.bodies.humanoid_kernels import INFERRED, UNSURE
from devices.bodies.source_joints import available_presets, source_joints
from devices.errors import InputError
from devices.osc.vmc_decoder import PERFORMER, VmcDecoder
from devices.osc.vmc_trackers import bone_of_tracker
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.transport.live_stream import LiveStream
from tests.devices.vmc_sender import (
    HUMAN,
    at,
    bones,
    bundle,
    expected,
    local_offsets,
    message,
    ok,
    root,
    slime,
)

REST = HUMAN.rest_positions
STEP = 1 / 60
CORE = [name for name in HUMAN.names if not name.endswith(SEGMENTS)]


def joint(name: str) -> int:
    return HUMAN.index(name)


def waving(k: int) -> dict[str, Rotation]:
    """Local rotations that differ from frame to frame, in our own space."""
    return {
        "Hips": Rotation.from_euler("y", 0.2 * k),
        "LeftUpperArm": Rotation.from_euler("z", 0.1 * k),
        "LeftLowerArm": Rotation.from_euler("y", -0.3),
        "Spine": Rotation.from_euler("x", 0.05 * k),
        "RightLowerArm": Rotation.from_euler("y", 0.1 * k),
    }


def fed(decoder: VmcDecoder, datagrams: Sequence[tuple[float, bytes]]) -> list[SkeletonFrame]:
    return [frame for at_, data in datagrams for frame in decoder.feed(data, at_)]


def test_a_bundle_a_frame_gives_each_frame_as_it_comes() -> None:
    decoder = VmcDecoder()
    assert decoder.feed(slime(0.0, waving(0)), 100.0) == []  # nobody knows yet that it is whole
    for k in range(1, 30):
        frames = decoder.feed(slime(k * STEP, waving(k)), 100.0 + k * STEP)
        newest = frames[-1]
        assert len(frames) == (2 if k == 1 else 1)
        assert newest.positions == pytest.approx(expected(waving(k)), abs=1e-6)
        assert newest.arrival == 100.0 + k * STEP
        assert newest.time == pytest.approx(newest.arrival, abs=1e-4)
        assert (newest.confidence == 1.0).all()
    assert decoder.refused == 0


def official(k: int, turns: dict[str, Rotation]) -> list[bytes]:
    """The order of the protocol's own sample: root, bones, trackers, blend shapes, OK, T."""
    return [
        root().dgram,
        bundle(bones(turns)[:30]),
        bundle(bones(turns)[30:]),
        bundle([message("/VMC/Ext/Tra/Pos", "LHR-1", *([0.0] * 6), 1.0)]),
        bundle([message("/VMC/Ext/Blend/Val", "Joy", 0.1 * k), message("/VMC/Ext/Blend/Apply")]),
        ok(1, 3, 0, 1).dgram,
        at(k * STEP).dgram,
    ]


def bare(k: int, turns: dict[str, Rotation]) -> list[bytes]:
    """Each message in a datagram of its own, and neither status nor time."""
    return [one.dgram for one in [root(), *bones(turns)]]


@pytest.mark.parametrize("cycle", [official, bare])
def test_a_frame_in_many_datagrams_is_put_together(cycle: object) -> None:
    assert callable(cycle)
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(30):
        begin = 50.0 + k * STEP
        for number, data in enumerate(cycle(k, waving(k))):
            frames += decoder.feed(data, begin + number * 2e-5)
    assert len(frames) == 30
    for k, frame in enumerate(frames):
        assert frame.positions == pytest.approx(expected(waving(k)), abs=1e-6)
        assert 0.0 <= frame.arrival - (50.0 + k * STEP) < 0.003
    times = np.diff([frame.time for frame in frames[3:]])
    assert times == pytest.approx(STEP, abs=0.002)
    assert decoder.refused == 0


def test_joining_in_the_middle_of_a_frame_sets_itself_right() -> None:
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(10):
        datagrams = [bundle(bones(waving(k))[part : part + 11]) for part in range(0, 55, 11)]
        for number, data in enumerate(datagrams):
            if k > 0 or number > 2:
                frames += decoder.feed(data, 50.0 + k * STEP + number * 1e-4)
    settled = [frame for frame in frames if frame.arrival > 50.0 + 4 * STEP]
    assert len(settled) == 6
    for k, frame in enumerate(settled, start=4):
        assert frame.positions == pytest.approx(expected(waving(k)), abs=1e-6)


@pytest.mark.parametrize("before", [0, 20], ids=["at the start", "in the midst"])
def test_frames_that_waited_in_a_queue_tear_none_after_them(before: int) -> None:
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    now = 50.0
    for k in range(before + 40):
        waited = before <= k < before + 12
        now += 0.0 if waited else STEP
        for part in (slice(0, 20), slice(20, 40), slice(40, 55)):
            said = bones(waving(k))[part] + (
                [ok(1, 3, 0, 1), at(k * STEP)] if part.start == 40 else []
            )
            frames += decoder.feed(bundle(said), now)
            now += 3e-5 if waited else 2e-4
    assert len(frames) == before + 40
    for k, frame in enumerate(frames):
        assert frame.positions == pytest.approx(expected(waving(k)), abs=1e-6)


def test_a_lost_datagram_leaves_its_bones_as_they_were_and_no_later_frame_torn() -> None:
    decoder = VmcDecoder()
    frames: list[SkeletonFrame] = []
    for k in range(12):
        for number, part in enumerate((slice(0, 30), slice(30, 55))):
            if not (k == 6 and number == 1):
                data = bundle(bones(waving(k))[part])
                frames += decoder.feed(data, 50.0 + k * STEP + number * 1e-4)
    assert len(frames) == 12
    assert set(frames[6].confidence[30:]) == {UNSURE}
    for k in (5, 7, 8, 11):
        assert frames[k].positions == pytest.approx(expected(waving(k)), abs=1e-6)


def test_left_stays_left_and_bones_keep_their_length() -> None:
    decoder = VmcDecoder()
    chance = np.random.default_rng(0)
    parents = HUMAN.parents
    child = np.flatnonzero(parents >= 0)
    lengths = np.linalg.norm(REST[child] - REST[parents[child]], axis=1)
    for k in range(20):
        turns = {name: Rotation.random(rng=chance) for name in HUMAN.names}
        frames = decoder.feed(slime(k * STEP, turns), 10.0 + k * STEP)
        for frame in frames[-1:]:
            positions = frame.positions
            found = np.linalg.norm(positions[child] - positions[parents[child]], axis=1)
            assert found == pytest.approx(lengths, abs=1e-6)
            assert frame.rotations is not None
            matrices = Rotation.from_quat(frame.rotations).as_matrix()
            assert np.linalg.det(matrices) == pytest.approx(1.0)
    still = fed(VmcDecoder(), [(k * STEP, slime(k * STEP)) for k in range(3)])[-1]
    assert still.positions[joint("LeftHand"), 0] > 0.5
    assert still.positions[joint("RightHand"), 0] < -0.5
    assert still.positions[:, 1].min() > 0.0


def test_the_root_carries_the_body() -> None:
    turn = Rotation.from_euler("y", 0.7)
    decoder = VmcDecoder()
    data = [bundle([at(k * STEP), root((1.0, 0.2, -3.0), turn), *bones()]) for k in range(3)]
    frame = fed(decoder, [(k * STEP, one) for k, one in enumerate(data)])[-1]
    moved = turn.apply(REST.copy()) + np.array([1.0, 0.2, -3.0])
    assert frame.positions == pytest.approx(moved, abs=1e-6)


def test_a_sender_of_zeros_gets_the_built_in_body() -> None:
    turns = waving(3)
    decoder = VmcDecoder()
    zeros = np.zeros_like(REST)
    data = [(k * STEP, bundle([at(k * STEP), *bones(turns, offsets=zeros)])) for k in range(3)]
    assert fed(decoder, data)[-1].positions == pytest.approx(expected(turns), abs=1e-6)


def test_hips_move_although_other_offsets_are_zero() -> None:
    offsets = np.zeros_like(REST)
    offsets[joint("Hips")] = (0.3, 1.1, 0.2)
    decoder = VmcDecoder()
    data = [(k * STEP, bundle([at(k * STEP), *bones(offsets=offsets)])) for k in range(3)]
    frame = fed(decoder, data)[-1]
    assert frame.positions == pytest.approx(REST - REST[joint("Hips")] + offsets[0], abs=1e-6)


def test_a_bone_of_no_plausible_length_gets_the_default_at_the_bodys_scale() -> None:
    offsets = 0.5 * local_offsets()
    offsets[joint("LeftLowerArm")] = (40.0, 0.0, 0.0)
    offsets[joint("RightHand")] = 0.0
    offsets[joint("Head")] *= 1e-3
    data = [(k * STEP, bundle([at(k * STEP), *bones(offsets=offsets)])) for k in range(3)]
    frame = fed(VmcDecoder(), data)[-1]
    assert frame.positions == pytest.approx(0.5 * REST, abs=1e-6)


def test_a_model_without_optional_bones_is_whole() -> None:
    lacking = {"UpperChest", "LeftShoulder", "RightShoulder", "LeftEye", "LeftToes"}
    offsets = local_offsets()
    for bone, above in (("Neck", "UpperChest"), ("LeftUpperArm", "LeftShoulder")):
        offsets[joint(bone)] += offsets[joint(above)]
    offsets[joint("LeftUpperArm")] += offsets[joint("UpperChest")]
    offsets[joint("RightUpperArm")] = offsets[joint("LeftUpperArm")] * (-1.0, 1.0, 1.0)
    only = [name for name in CORE if name not in lacking]
    turns = {"Spine": Rotation.from_euler("x", 0.8), "LeftUpperArm": Rotation.from_euler("z", 1.0)}
    data = [
        (k * STEP, bundle([at(k * STEP), *bones(turns, offsets=offsets, only=only)]))
        for k in range(3)
    ]
    frame = fed(VmcDecoder(), data)[-1]
    whole = expected(turns)
    sent = [joint(name) for name in only]
    assert frame.positions[sent] == pytest.approx(whole[sent], abs=1e-6)
    assert (frame.confidence[sent] == 1.0).all()
    # What is rigid with a bone that came is inferred: on the way from chest to neck, on the head.
    for name in ("UpperChest", "LeftEye", "LeftToes", "LeftMiddleProximal"):
        assert frame.confidence[joint(name)] == INFERRED
        assert frame.positions[joint(name)] == pytest.approx(whole[joint(name)], abs=0.02)
    unknown = [joint(f"Left{finger}{end}") for finger in FINGERS for end in SEGMENTS[1:]]
    assert np.isnan(frame.positions[unknown]).all()
    assert (frame.confidence[unknown] == 0.0).all()
    assert ((frame.confidence == 0.0) == np.isnan(frame.positions[:, 0])).all()


def test_a_vrm1_model_is_calibrated_by_its_t_pose() -> None:
    """Bones whose own axes lie anyhow at rest, and a sender that gives rotations alone."""
    chance = np.random.default_rng(5)
    own = {name: Rotation.random(rng=chance) for name in HUMAN.names}

    def as_sent(turns: dict[str, Rotation]) -> dict[str, Rotation]:
        sent = {}
        for number, name in enumerate(HUMAN.names):
            above = int(HUMAN.parents[number])
            upper = own[HUMAN.names[above]] if above >= 0 else Rotation.identity()
            sent[name] = upper.inv() * turns.get(name, Rotation.identity()) * own[name]
        return sent

    for offsets in (np.zeros_like(REST), local_offsets()):
        in_bones = np.array(
            [
                own[HUMAN.names[above]].inv().apply(offset) if above >= 0 else offset
                for above, offset in zip(HUMAN.parents, offsets, strict=True)
            ]
        )
        decoder = VmcDecoder(tpose=1.0)
        frames: list[SkeletonFrame] = []
        for k in range(20):
            turns = as_sent({} if k < 15 else waving(4))
            data = bundle([at(k / 10), *bones(turns, offsets=in_bones)])
            frames += decoder.feed(data, 5.0 + k / 10)
        assert frames[14].positions == pytest.approx(REST, abs=1e-5)
        assert frames[-1].positions == pytest.approx(expected(waving(4)), abs=1e-5)
        assert frames[14].rotations is not None
        assert np.abs(frames[14].rotations[:, 3]) == pytest.approx(1.0, abs=1e-6)


def test_a_model_that_is_not_loaded_gives_no_frames_and_bad_tracking_is_unsure() -> None:
    decoder = VmcDecoder()
    assert fed(decoder, [(k * STEP, bundle([*bones(), ok(0)])) for k in range(5)]) == []
    assert len(fed(decoder, [(1 + k * STEP, bundle([*bones(), ok(1)])) for k in range(5)])) == 5
    unsure = fed(decoder, [(2 + k * STEP, bundle([*bones(), ok(1, 3, 0, 0)])) for k in range(3)])
    assert set(unsure[-1].confidence) == {UNSURE}


def test_expressions_are_committed_together() -> None:
    decoder = VmcDecoder()
    decoder.feed(bundle([message("/VMC/Ext/Blend/Val", "喜び", 0.5)]), 0.0)
    assert decoder.expressions == {}
    decoder.feed(bundle([message("/VMC/Ext/Blend/Val", "A", 1.0)]), 0.0)
    decoder.feed(bundle([message("/VMC/Ext/Blend/Apply")]), 0.0)
    assert decoder.expressions == {"喜び": 0.5, "A": 1.0}
    for number in range(2000):
        decoder.feed(message("/VMC/Ext/Blend/Val", f"name {number}", 1.0).dgram, 0.0)
    decoder.feed(message("/VMC/Ext/Blend/Apply").dgram, 0.0)
    assert len(decoder.expressions) == 512
    assert decoder.refused == 2000 - 512


def test_duplicates_and_late_datagrams_change_nothing() -> None:
    plain, shaken = VmcDecoder(), VmcDecoder()
    data = [(10.0 + k * STEP, slime(k * STEP, waving(k))) for k in range(40)]
    wanted = fed(plain, data)
    order = []
    for k, (when, one) in enumerate(data):
        order.append((when, one))
        if k % 3 == 0:
            order.append((when + 1e-4, one))
        if k % 7 == 6:
            order.append((when + 2e-4, data[k - 2][1]))
    found = fed(shaken, order)
    assert len(found) == len(wanted)
    for a, b in zip(found, wanted, strict=True):
        assert np.array_equal(a.positions, b.positions)
        assert a.time == pytest.approx(b.time, abs=0.01)
    assert shaken.refused > 10


def test_a_sender_that_starts_again_is_followed_at_once_whatever_its_clock() -> None:
    decoder = VmcDecoder()
    before = fed(decoder, [(10 + k * STEP, slime(900 + k * STEP, waving(k))) for k in range(30)])
    smaller = [name for name in CORE if name != "Jaw"]
    after = fed(
        decoder,
        [
            (15 + k * STEP, bundle([at(k * STEP), ok(), *bones(waving(k), only=smaller)]))
            for k in range(30)
        ],
    )
    assert (len(before), len(after)) == (30, 30)
    times = [frame.time for frame in [*before, *after]]
    assert times == sorted(times)
    assert after[-1].arrival - after[-1].time < 0.01
    assert after[-1].confidence[joint("Jaw")] == INFERRED
    assert after[-1].positions[joint("LeftHand")] == pytest.approx(
        expected(waving(29))[joint("LeftHand")], abs=0.02
    )


@pytest.mark.parametrize("back", [0.1, 0.25, 100.0])
def test_a_clock_that_is_set_back_or_stands_does_not_end_the_show(back: float) -> None:
    decoder = VmcDecoder()
    fed(decoder, [(k * STEP, slime(500 + k * STEP, waving(k))) for k in range(30)])
    standing = slime(500 + 29 * STEP - back)
    frames = fed(decoder, [(1 + k * STEP, standing) for k in range(300)])
    assert len(frames) > 250
    assert frames[-1].arrival - frames[-1].time < 0.02


POSE = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    "bad",
    [
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:6]),
        message("/VMC/Ext/Bone/Pos", "Hips", *[1, 0, 0, 0, 0, 0, 1]),
        message("/VMC/Ext/Bone/Pos", 7.0, *POSE),
        message("/VMC/Ext/Bone/Pos", "Hips", math.nan, *POSE[1:]),
        message("/VMC/Ext/Bone/Pos", "Hips", 3e38, *POSE[1:]),
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:3], 0.0, 0.0, 0.0, 0.0),
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:6], math.inf),
        message("/VMC/Ext/Bone/Pos", "Hips", *POSE[:6], 9.0),
        message("/VMC/Ext/Root/Pos", "root", math.nan, *POSE[1:]),
        message("/VMC/Ext/Root/Pos", "root"),
        message("/VMC/Ext/OK", 1.0),
        message("/VMC/Ext/OK"),
        message("/VMC/Ext/T", 1),
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
