"""Gestures are recognised of whole, seated and one-handed performers, and never by accident."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.skeleton import Skeleton, SkeletonFrame
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.player import EveryFrame, Player
from replay.recording import Recording
from runtime.control.gestures import HELD, RAISED, Arm, Gestures, arms_of
from runtime.driving.performer import Performer

RATE = 30
BODY = builtin_recording("wave").skeleton
LEFT, RIGHT = arms_of(BODY)
Places = np.ndarray


def hand_at(skeleton: Skeleton, way: tuple[float, float, float], *arms: Arm) -> Places:
    """The rest pose with arms that point to a way, for a left arm; mirrored for a right one."""
    places = skeleton.rest_positions.copy()
    for arm in arms:
        shoulder, elbow, wrist = arm.joints
        toward = np.array(way) * (arm.side, 1.0, 1.0)
        for joint, share in ((elbow, 0.5), (wrist, 1.0)):
            places[joint] = places[shoulder] + share * arm.length * toward
    return places


def done(
    kind: str, seconds: float, pose: Callable[[float], Places], unseen: tuple[int, ...] = ()
) -> tuple[list[float], str]:
    """When a gesture was complete [s], and what was wanted last."""
    performer, gestures = Performer(BODY), Gestures(BODY, kind)
    times = []
    for number in range(round(seconds * RATE)):
        places = pose(number / RATE).copy()
        confidence = np.ones(len(places))
        places[list(unseen)], confidence[list(unseen)] = np.nan, 0.0
        frame = SkeletonFrame(number / RATE, places, None, confidence)
        if gestures.follow(performer.follow(frame)):
            times.append(number / RATE)
    return times, gestures.wanted


DOWN = hand_at(BODY, (0.05, -1.0, 0.0), LEFT, RIGHT)
OUT = hand_at(BODY, (1.0, 0.0, 0.0), LEFT, RIGHT)
UP = hand_at(BODY, (0.1, 0.99, 0.0), LEFT)
UP[list(RIGHT.joints)] = DOWN[list(RIGHT.joints)]


def test_arms_stretched_out_count_once_after_two_seconds_and_again_when_let_go() -> None:
    def pose(time: float) -> Places:
        return OUT if 1.0 <= time < 6.0 or time >= 7.0 else DOWN

    times, wanted = done("pose", 10.0, pose)
    assert times == pytest.approx([1.0 + HELD, 7.0 + HELD], abs=0.05)
    assert wanted == "Stretch both arms out to the side for 2 s"


def test_who_moves_holds_no_pose() -> None:
    def swinging(time: float) -> Places:
        angle = 0.3 * np.sin(3.0 * time)
        return hand_at(BODY, (np.cos(angle), np.sin(angle), 0.0), LEFT, RIGHT)

    assert done("pose", 10.0, swinging)[0] == []


def test_only_the_arm_that_is_seen_is_asked_for() -> None:
    """The other arm, and the legs of somebody who sits at a table, are not seen."""
    unseen = (*RIGHT.joints, *(k for k, n in enumerate(BODY.names) if "Leg" in n or "Foot" in n))
    one = hand_at(BODY, (1.0, 0.0, 0.0), LEFT)
    times, wanted = done("pose", 4.0, lambda _: one, unseen)
    assert len(times) == 1
    assert "your left arm" in wanted
    times, wanted = done("clap", 4.0, lambda _: UP, RIGHT.joints)
    assert len(times) == 1, "one hand cannot clap: it is raised"
    assert "Raise your left hand" in wanted
    assert done("pose", 4.0, lambda _: one, (*RIGHT.joints, *LEFT.joints)) == ([], "")


def test_one_hand_above_the_head_counts_and_two_do_not() -> None:
    times, _ = done("raise", 3.0, lambda time: UP if time >= 0.5 else DOWN)
    assert times == pytest.approx([0.5 + RAISED], abs=0.05)
    both = hand_at(BODY, (0.1, 0.99, 0.0), LEFT, RIGHT)
    assert done("raise", 3.0, lambda _: both)[0] == []


def claps(count: int, every: float, height: float = -0.3) -> Callable[[float], Places]:
    def pose(time: float) -> Places:
        beat = time / every - 0.5
        meets = time / every >= 0.5 and beat < count and beat % 1.0 < 0.4
        places = DOWN.copy()
        for arm in (LEFT, RIGHT):
            shoulder, _, wrist = arm.joints
            middle = np.array([0.02 * arm.side if meets else 0.3 * arm.side, 0.0, 0.0])
            middle[1:] = places[shoulder, 1] + height * arm.length, 0.6 * arm.length
            places[wrist] = middle
        return places

    return pose


@pytest.mark.parametrize(
    ("pose", "count"),
    [
        (claps(3, 0.5), 1),
        (claps(6, 0.5), 2),
        (claps(2, 0.5), 0),
        (claps(3, 1.5), 0),
        (claps(6, 0.5, height=0.9), 0),
    ],
    ids=["three", "six", "two", "slow", "overhead"],
)
def test_three_claps_before_the_chest_count(pose: Callable[[float], Places], count: int) -> None:
    assert len(done("clap", 6.0, pose)[0]) == count


def gestures_in(recording: Recording, kind: str) -> list[float]:
    performer, gestures = Performer(recording.skeleton), Gestures(recording.skeleton, kind)
    player, times = Player(recording, EveryFrame()), []
    while not player.ended:
        for frame in player.poll():
            if gestures.follow(performer.follow(frame)):
                times.append(frame.time - recording.times[0])
    return times


PERFORMANCES = [
    "cmu1_jumping_jacks_animdraw", "cmu_12_01_walk", "cmu_daz_salsa_10", "fair1_dab",
    "fair1_wave_hello", "bandai1_dash_happy_001", "bandai1_bow_normal_001",
    "bandai1_call_normal_001", "mixamo_joe_walk_in_circle", "cmu_05_01_mocapnet",
]  # fmt: skip


@pytest.mark.parametrize("name", PERFORMANCES)
def test_no_gesture_is_made_by_accident_in_a_real_performance(shared: Path, name: str) -> None:
    recording = read_recording(shared / "bvh" / f"{name}.bvh")
    assert {kind: gestures_in(recording, kind) for kind in ("pose", "clap", "raise")} == {
        "pose": [],
        "clap": [],
        "raise": [],
    }


def test_the_third_of_three_real_claps_counts(shared: Path) -> None:
    recording = read_recording(shared / "leap" / "leapjs_playback" / "three-claps.json.lz")
    (time,) = gestures_in(recording, "clap")
    assert 2.9 < time < 3.2
    assert gestures_in(recording, "pose") == []
