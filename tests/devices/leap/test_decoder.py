"""The decoder of a Leap service's messages: hands, sides, device events, hostile messages."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from devices.leap.hands import leap_frame
from devices.leap.joints import FINGERS, SIDES, chest, leap_to_world
from devices.leap.performer import HandSides
from devices.leap.websocket_messages import LeapDecoder
from tests.devices.leap.leap_messages import (
    HEADER,
    HOSTILE,
    both,
    device_event,
    feed,
    fingers,
    hand,
    message,
    place,
)


def test_hands_stand_in_the_world_as_over_the_device() -> None:
    decoder = LeapDecoder()
    frame = feed(decoder, both(0))
    np.testing.assert_allclose(place(decoder, frame, "right_palm"), leap_to_world([80, 200, 50]))
    for kind, name in enumerate(FINGERS):
        tip = leap_to_world([-80.0 + 20.0 * (kind - 2), 200.0, -80.0])
        np.testing.assert_allclose(place(decoder, frame, f"left_{name}_tip"), tip)
    np.testing.assert_allclose(place(decoder, frame, "hands"), chest())
    assert (frame.confidence == 0.75).all()
    assert place(decoder, frame, "left_palm")[0] > 0 > place(decoder, frame, "right_palm")[0]


def test_left_and_right_hands_have_rotations_that_mirror_each_other() -> None:
    decoder = LeapDecoder()
    points = fingers(1, -80.0, bend=0.5, side="left") + fingers(2, 80.0, bend=0.5)
    frame = feed(decoder, message(0, [hand(1, "left", -80.0), hand(2, "right", 80.0)], points))
    assert frame.rotations is not None
    turn = 1e3 * leap_to_world(np.eye(3)).T
    for side in SIDES:
        straight = frame.rotations[decoder.skeleton.index(f"{side}_index_pip")]
        bent = frame.rotations[decoder.skeleton.index(f"{side}_index_dip")]
        np.testing.assert_allclose(Rotation.from_quat(straight).as_matrix(), turn, atol=1e-9)
        relative = Rotation.from_quat(straight).inv() * Rotation.from_quat(bent)
        # The flexion axis is the bone's own x, of both hands, as the left hand's was turned round.
        np.testing.assert_allclose(relative.as_rotvec(), [-0.5, 0, 0], atol=1e-9)
        for joint in ("palm", "wrist", "elbow"):
            found = frame.rotations[decoder.skeleton.index(f"{side}_{joint}")]
            np.testing.assert_allclose(Rotation.from_quat(found).as_matrix(), turn, atol=1e-9)


def test_one_hand_alone_is_followed_when_asked_for() -> None:
    decoder = LeapDecoder("left")
    frame = feed(decoder, both(0))
    np.testing.assert_allclose(place(decoder, frame, "palm"), leap_to_world([-80, 200, 50]))
    assert decoder.skeleton.rest_positions[decoder.skeleton.index("thumb_tip")][0] < 0
    assert LeapDecoder("right").skeleton.rest_positions[decoder.skeleton.index("thumb_tip")][0] > 0


@pytest.mark.parametrize("lost", [1, 10, 300])
def test_a_hand_that_was_lost_is_unseen_and_comes_back_on_its_side(lost: int) -> None:
    decoder = LeapDecoder()
    feed(decoder, both(0), 0.0)
    for index in range(lost):
        gone = feed(decoder, message(index + 1, [hand(2, "right", 80.0)], fingers(2, 80.0)))
        assert np.isnan(place(decoder, gone, "left_palm")).all()
        assert np.isfinite(place(decoder, gone, "right_palm")).all()
    back = [hand(2, "right", 80.0), hand(9, "left", -60.0)]
    frame = feed(decoder, message(lost + 1, back, fingers(9, -60.0) + fingers(2, 80.0)))
    np.testing.assert_allclose(place(decoder, frame, "left_palm"), leap_to_world([-60, 200, 50]))
    np.testing.assert_allclose(place(decoder, frame, "right_palm"), leap_to_world([80, 200, 50]))


def test_no_hand_is_a_frame_with_nothing_seen() -> None:
    frame = feed(LeapDecoder(), message(0, [], []))
    assert np.isnan(frame.positions).all()
    assert not frame.confidence.any()


def sides_of(follow: HandSides, *hands: dict[str, Any]) -> dict[str, int]:
    frame = leap_frame(message(0, list(hands), []))
    return {side: found.id for side, found in follow(frame.hands).items()}


def test_hands_without_a_side_keep_the_one_they_have_and_come_back_by_place() -> None:
    follow = HandSides()
    assert sides_of(follow, hand(4, None, 80.0), hand(5, None, -80.0)) == {"right": 4, "left": 5}
    crossed = hand(4, None, -90.0), hand(5, None, 90.0)
    assert sides_of(follow, *crossed) == {"right": 4, "left": 5}
    assert sides_of(follow, hand(5, None, 90.0)) == {"left": 5}
    # The right hand was lost on the left side of the device, and comes back there.
    assert sides_of(follow, hand(5, None, 90.0), hand(6, None, -100.0)) == {"left": 5, "right": 6}


def test_of_two_hands_of_one_side_the_one_that_was_there_is_taken_else_the_nearest() -> None:
    follow = HandSides()
    assert sides_of(follow, hand(1, "right", 50.0)) == {"right": 1}
    ghost = hand(2, "right", 10.0, confidence=1.0)
    assert sides_of(follow, ghost, hand(1, "right", 60.0)) == {"right": 1}
    assert sides_of(follow, hand(8, "right", 400.0), hand(7, "right", 70.0)) == {"right": 7}


def test_a_header_of_an_older_protocol_and_its_frames_are_taken() -> None:
    decoder = LeapDecoder()
    assert decoder.feed(b'{"version": 1}', 0.0) == []
    assert decoder.version == 1
    spread = {77: (-75.0, 35.0), 5: (-35.0, 90.0), 40: (-5.0, 100.0), 8: (25.0, 92.0), 61: (60, 70)}
    tips = [
        {"id": one, "handId": 3, "tool": False, "tipPosition": [80 + x, 200.0, 50.0 - forward]}
        for one, (x, forward) in spread.items()
    ]
    for order in (1, -1):
        frame = feed(decoder, message(0, [hand(3, None, 80.0)], tips[::order]))
        for name, (x, forward) in zip(FINGERS, spread.values(), strict=True):
            tip = leap_to_world([80 + x, 200.0, 50.0 - forward])
            np.testing.assert_allclose(place(decoder, frame, f"right_{name}_tip"), tip)


def test_an_arm_that_is_not_told_is_put_behind_the_palm_and_less_sure() -> None:
    decoder = LeapDecoder()
    bare = hand(2, "right", 80.0)
    del bare["wrist"], bare["elbow"]
    frame = feed(decoder, message(0, [bare], fingers(2, 80.0)))
    for name, z in (("wrist", 115.0), ("elbow", 365.0)):
        expected = leap_to_world([80, 200, z])
        np.testing.assert_allclose(place(decoder, frame, f"right_{name}"), expected)
        assert frame.confidence[decoder.skeleton.index(f"right_{name}")] == 0.375
    bare["direction"] = [0.0, 0.0, 0.0]
    frame = feed(decoder, message(1, [bare], fingers(2, 80.0)))
    assert np.isnan(place(decoder, frame, "right_wrist")).all()


def test_device_events_say_what_is_wrong() -> None:
    decoder = LeapDecoder()
    assert decoder.feed(json.dumps(HEADER).encode(), 0.0) == []
    assert decoder.trouble == ""
    for attached, streaming, says in (
        (True, True, ""),
        (True, False, "plugged in but paused"),
        (False, False, "not plugged in"),
        (True, True, ""),
    ):
        assert decoder.feed(device_event(attached, streaming), 0.0) == []
        assert says in decoder.trouble
        assert bool(says) == bool(decoder.trouble)
    for number in range(100):
        decoder.feed(device_event(True, True, str(number)), 0.0)
    assert len(decoder.devices) <= 16
    decoder.feed(json.dumps(HEADER).encode(), 0.0)
    assert not decoder.devices
    assert decoder.refused == 0


@pytest.mark.parametrize("data", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_no_message_is_refused_and_counted(data: bytes) -> None:
    decoder = LeapDecoder()
    assert decoder.feed(data, 0.0) == []
    assert decoder.refused == 1


@pytest.mark.parametrize(
    "change",
    [
        {"palmPosition": [1e9, 0, 0]},
        {"palmPosition": [float("nan")] * 3},
        {"palmPosition": "here"},
        {"id": [1]},
        {"confidence": float("inf")},
        {"type": ["left"]},
        {"armBasis": [[0, 0, 0]] * 3, "direction": [0, 0, 0]},
        {"armBasis": [[float("nan")] * 3] * 3, "palmNormal": None},
        {"direction": [1e300, 1e300, 1e300]},
    ],
)
def test_odd_values_in_a_hand_are_unseen(change: dict[str, Any]) -> None:
    found = both(0)
    found["hands"][0] |= change
    frame = feed(LeapDecoder(), found)
    seen = frame.confidence > 0
    assert np.isfinite(frame.positions[seen]).all()
    assert np.isnan(frame.positions[~seen]).all()
    assert ((frame.confidence >= 0) & (frame.confidence <= 1)).all()


def test_the_device_s_clock_paces_frames_and_may_begin_anew() -> None:
    decoder = LeapDecoder()
    times = [feed(decoder, both(index), 3.0 + 0.01 * index).time for index in range(50)]
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)
    restarted = feed(decoder, both(0), 4.0)
    assert restarted.time == 4.0
    missing = both(1)
    del missing["timestamp"]
    assert feed(decoder, missing, 4.5).time == 4.5
