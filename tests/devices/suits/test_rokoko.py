"""Rokoko's scenes as its documents write them: actors in place, bounded, steady."""

from __future__ import annotations

import copy
import json
import socket
from typing import Any

import lz4.frame
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.bodies.source_joints import available_presets, source_joints
from devices.skeleton import SkeletonFrame
from devices.stream import open_stream
from devices.suits.rokoko import MOST_ACTORS, MOST_BYTES, MOST_OVERTAKEN, RokokoDecoder
from devices.suits.rokoko_bones import SKELETON
from devices.transport.live_stream import LiveStream
from tests.devices.sender_packets import (
    ROKOKO,
    STEP,
    bones,
    packed,
    plain,
    posed,
    rokoko_v2,
    rokoko_v3,
)
from tests.waiting import PATIENCE

COUNT = len(SKELETON.names)
TURNS = Rotation.from_euler("yx", np.linspace(0.1, 1.0, 2 * COUNT).reshape(COUNT, 2))


def joint(name: str) -> int:
    return SKELETON.index(name)


def scene(k: int = 0, *names: str, version: int = 3) -> dict[str, Any]:
    make = rokoko_v3 if version == 3 else rokoko_v2
    actors = {name: bones(posed(ROKOKO, k) + n) for n, name in enumerate(names or ("Ann",))}
    return make(actors, k * STEP)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("wrap", [plain, packed])
def test_the_golden_scene_is_one_body(version: int, wrap: Any) -> None:
    make = rokoko_v3 if version == 3 else rokoko_v2
    data = wrap(make({"Ann": bones(posed(ROKOKO), TURNS)}, 12.5))
    assert data[:4] == (b"\x04\x22\x4d\x18" if wrap is packed else b'{"ve')
    decoder = RokokoDecoder()
    (frame,) = decoder.feed(data, 50.0)
    assert frame.positions == pytest.approx(posed(ROKOKO), abs=1e-9)
    assert frame.rotations is not None
    assert (Rotation.from_quat(frame.rotations) * TURNS.inv()).magnitude().max() < 1e-7
    assert (frame.confidence == 1.0).all()
    assert (frame.performer, frame.arrival, frame.time) == (0, 50.0, 50.0)
    assert decoder.refused == 0


def test_version_two_and_a_half_calls_itself_three() -> None:
    message = scene(version=2) | {"version": 3}
    assert len(RokokoDecoder().feed(plain(message), 1.0)) == 1
    assert len(RokokoDecoder().feed(plain(message | {"version": "2,5"}), 1.0)) == 1


def test_bytes_written_out_by_hand() -> None:
    data = (
        b'{"version":3,"fps":60,"scene":{"timestamp":0.5,"actors":[{"name":"A","body":{"hip":'
        b'{"position":{"x":-1,"y":2,"z":3},"rotation":{"x":0,"y":0,"z":0.6,"w":0.8}}}}]}}'
    )
    (frame,) = RokokoDecoder().feed(data, 1.0)
    assert frame.positions[joint("hip")].tolist() == [1.0, 2.0, 3.0]
    assert frame.rotations is not None
    assert frame.rotations[joint("hip")] == pytest.approx([0.0, 0.0, -0.6, 0.8])
    assert np.count_nonzero(frame.confidence) == 1
    assert np.isnan(frame.positions[1:]).all()


def test_left_stays_left_and_faces_forward() -> None:
    data = plain(rokoko_v3({"Ann": bones(ROKOKO.rest_positions)}))
    sent = json.loads(data)["scene"]["actors"][0]["body"]
    assert sent["leftHand"]["position"]["x"] < 0  # as Unity has it
    (frame,) = RokokoDecoder().feed(data, 1.0)
    at = dict(zip(SKELETON.names, frame.positions, strict=True))
    left, up = at["leftHand"] - at["rightHand"], at["head"] - at["hip"]
    forward = at["leftToe"] - at["leftFoot"]
    assert left[0] > 1.0
    assert up[1] > 0.5
    assert forward[2] > 0.1
    assert np.linalg.det([left, up, forward]) > 0.0


def test_actors_are_known_by_their_names() -> None:
    decoder = RokokoDecoder()
    frames = list(decoder.feed(plain(scene(0, "Ann", "Bob")), 1.0))
    frames += decoder.feed(plain(scene(1, "Bob", "Cid")), 1.02)
    frames += decoder.feed(plain(scene(2, "Cid", "Ann")), 1.04)
    assert [frame.performer for frame in frames] == [0, 1, 1, 2, 2, 0]
    assert frames[1].positions == pytest.approx(posed(ROKOKO, 0) + 1, abs=1e-9)


def test_many_names_one_after_another_take_no_more_numbers() -> None:
    decoder = RokokoDecoder()
    frames = [
        f for k in range(100) for f in decoder.feed(plain(scene(k, "Ann", f"x{k}")), 1 + k * STEP)
    ]
    assert {frame.performer for frame in frames[::2]} == {0}
    assert max(frame.performer for frame in frames) < MOST_ACTORS
    assert len(decoder._numbers) <= MOST_ACTORS


def test_a_clip_that_loops_and_a_clock_that_stands_go_on() -> None:
    decoder = RokokoDecoder()
    stamps = [*np.arange(0, 1, STEP), *np.arange(0, 1, STEP), *[0.9] * 40, 0.0, 0.1]
    frames: list[SkeletonFrame] = []
    for k, stamp in enumerate(stamps):
        data = plain(rokoko_v3({"Ann": bones(posed(ROKOKO, k))}, float(stamp)))
        frames += decoder.feed(data, 100.0 + k * STEP)
    assert len(frames) == len(stamps) - MOST_OVERTAKEN  # of going back by so little, to 0.9
    times = np.array([frame.time for frame in frames])
    assert (np.diff(times) >= 0.0).all()
    assert (np.abs(times - [frame.arrival for frame in frames]) < 0.15).all()


def test_repeated_and_overtaken_scenes_are_left_out() -> None:
    decoder = RokokoDecoder()
    at = [packed(scene(k)) for k in range(8)]
    frames: list[SkeletonFrame] = []
    for n, k in enumerate([0, 1, 1, 3, 2, 4, 5]):
        frames += decoder.feed(at[k], 10.0 + n * 0.002)
    heights = [float(f.positions[joint("leftHand"), 1]) for f in frames]
    wanted = [float(posed(ROKOKO, k)[joint("leftHand"), 1]) for k in (0, 1, 3, 4, 5)]
    assert heights == pytest.approx(wanted, abs=1e-9)
    assert decoder.refused == 2


def test_a_sender_that_starts_again_is_heard_at_once() -> None:
    decoder = RokokoDecoder()
    for k in range(500, 560):
        decoder.feed(plain(scene(k)), 10.0 + k * STEP)
    frames = [f for k in range(60) for f in decoder.feed(plain(scene(k)), 20.0 + k * STEP)]
    assert len(frames) == 60
    assert {frame.performer for frame in frames} == {0}
    assert frames[-1].time == pytest.approx(frames[-1].arrival, abs=1e-6)


def broken(edit: Any) -> dict[str, Any]:
    message = copy.deepcopy(scene())
    edit(message["scene"]["actors"][0]["body"])
    return message


@pytest.mark.parametrize(
    "edit",
    [
        lambda body: body.update(head="here"),
        lambda body: body.update(head=[1, 2, 3]),
        lambda body: body["head"].update(position=None),
        lambda body: body["head"]["position"].pop("y"),
        lambda body: body["head"]["position"].update(x="1"),
        lambda body: body["head"]["position"].update(x=True),
        lambda body: body["head"]["position"].update(x=float("nan")),
        lambda body: body["head"]["position"].update(x=float("inf")),
        lambda body: body["head"]["position"].update(x=1e30),
        lambda body: body["head"]["position"].update(x=10**400),
    ],
)
def test_a_bone_that_is_none_is_not_seen_and_counted(edit: Any) -> None:
    decoder = RokokoDecoder()
    (frame,) = decoder.feed(plain(broken(edit)), 1.0)
    assert decoder.refused == 1
    assert np.isnan(frame.positions[joint("head")]).all()
    assert frame.confidence[joint("head")] == 0.0
    assert np.count_nonzero(frame.confidence) == COUNT - 1


@pytest.mark.parametrize("w", [0.0, 1e-9, 100.0, float("nan")])
def test_a_rotation_that_is_none_is_unknown(w: float) -> None:
    message = broken(lambda body: body["head"].update(rotation={"x": 0, "y": 0, "z": 0, "w": w}))
    (frame,) = RokokoDecoder().feed(plain(message), 1.0)
    assert frame.rotations is not None
    assert np.isnan(frame.rotations[joint("head")]).all()
    assert frame.confidence[joint("head")] == 1.0


def test_other_bones_are_no_fault() -> None:
    decoder = RokokoDecoder()
    assert decoder.feed(plain(broken(lambda body: body.update(tail=body["head"]))), 1.0)
    assert decoder.refused == 0


HOSTILE = {
    "nothing": b"",
    "half of it": plain(scene())[:-20],
    "half of it, packed": packed(scene())[:-20],
    "packed twice over": packed(scene()) * 2,
    "too much, plain": plain(scene()) + b" " * MOST_BYTES,
    "too much, packed": lz4.frame.compress(plain(scene()) + b" " * MOST_BYTES),
    "a bomb": lz4.frame.compress(b" " * (MOST_BYTES + 1)),
    "a bomb's beginning": lz4.frame.compress(b"0" * (40 << 20))[:65507],
    "a magic number alone": b"\x04\x22\x4d\x18",
    "noise after it": b"\x04\x22\x4d\x18" + bytes(range(200)),
    "deep": b"[" * 60_000,
    "deep, packed": lz4.frame.compress(b'{"scene":' * 100_000),
    "a list": b"[1, 2]",
    "a number": b"1" * 60_000,
    "not UTF-8": b'{"scene": {"actors": [], "x": "\xff\xfe"}}',
    "no actors": b'{"version": 3, "scene": {"timestamp": 1}}',
    "a scene that is none": b'{"version": 3, "scene": 5}',
    "actors that are none": b'{"version": 3, "scene": {"actors": {"a": 1}}}',
    "an actor that is none": b'{"version": 3, "scene": {"actors": [7]}}',
    "an actor without a name": plain({"actors": [{"hip": bones(posed(ROKOKO))["hip"]}]}),
    "an actor without a body": plain({"actors": [{"name": "Ann"}]}),
    "a body that is none": plain({"actors": [{"name": "Ann", "body": []}]}),
    "a name without end": plain({"actors": [{"name": "A" * 5000, **bones(posed(ROKOKO))}]}),
    "a crowd": plain({"actors": [{"name": str(n)} for n in range(MOST_ACTORS + 1)]}),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_malformed_datagrams_are_left_out_and_counted(name: str) -> None:
    decoder = RokokoDecoder()
    assert not decoder.feed(HOSTILE[name], 1.0)
    assert decoder.refused == 1
    assert len(decoder.feed(packed(scene()), 1.1)) == 1


def test_one_name_twice_is_one_actor() -> None:
    message = scene(0, "Ann", "Bob")
    message["scene"]["actors"][1]["name"] = "Ann"
    decoder = RokokoDecoder()
    assert [frame.performer for frame in decoder.feed(plain(message), 1.0)] == [0]
    assert decoder.refused == 1


def test_the_presets_work() -> None:
    wanted = {"whole", "upper", "arms", "legs", "left-arm", "right-leg", "left-hand", "spine"}
    assert wanted <= set(available_presets(SKELETON))
    hand = [SKELETON.names[j] for j in source_joints(SKELETON, "left-hand")]
    assert hand[0] == "leftHand"
    assert len(hand) == 21
    for name in SKELETON.names:
        if name.startswith("left"):
            here = SKELETON.rest_positions[joint(name)]
            other = SKELETON.rest_positions[joint(name.replace("left", "right"))]
            assert here == pytest.approx(other * (-1.0, 1.0, 1.0))
            assert here[0] > 0.0


def test_through_a_socket() -> None:
    with open_stream("rokoko://127.0.0.1:0") as stream:
        assert isinstance(stream, LiveStream)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(packed(scene()), ("127.0.0.1", stream.transport.port))
        assert stream.wait(PATIENCE)
        (frame,) = stream.poll()
    assert frame.positions == pytest.approx(posed(ROKOKO), abs=1e-9)
