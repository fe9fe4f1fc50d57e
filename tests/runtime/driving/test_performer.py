"""A performer as the characters see one: whole, and facing the stage."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from devices.skeleton import Skeleton
from runtime.driving.performer import Performer, rest_state
from solvers.retarget.heading import turned
from tests.runtime.stick_figures import BODY, HIPS, T_POSE, frame, pose


@pytest.mark.parametrize("heading", [-1.2, 0.0, 0.4, 2.9])
def test_the_heading_is_measured_and_can_be_taken_out(heading: float) -> None:
    performer = Performer(BODY)
    seen = performer.follow(frame(pose(T_POSE, heading=heading, moved=(1.0, 0.2, -3.0))))
    assert seen.heading == pytest.approx(heading)
    straight = pose(T_POSE, moved=(1.0, 0.2, -3.0))
    np.testing.assert_allclose(seen.facing(0.0), straight, atol=1e-12)
    np.testing.assert_allclose(seen.facing(0.5), turned(straight, 0.5, straight[HIPS]), atol=1e-12)
    np.testing.assert_allclose(seen.facing(seen.heading), seen.seen, atol=1e-12)
    np.testing.assert_allclose(seen.hips, straight[HIPS])
    assert performer.pose is seen


def test_who_turns_round_and_round_keeps_turning() -> None:
    performer = Performer(BODY)
    headings = np.linspace(0.0, 4.0 * np.pi, 41)
    measured = [performer.follow(frame(pose(heading=h), h)).heading for h in headings]
    np.testing.assert_allclose(measured, headings, atol=1e-9)


def test_a_rest_state_keeps_the_height_of_the_hips_as_one_stands() -> None:
    performer = Performer(BODY)
    stands = performer.follow(frame(pose()))
    jumps = performer.follow(frame(pose(T_POSE, heading=0.8, moved=(0.0, 0.4, 0.0)), 0.1))
    assert BODY.rest_positions[:, 1].min() > 0.02, "no joint is as low as the sole"
    expected = BODY.rest_positions[HIPS, 1]
    assert rest_state(stands).height == pytest.approx(expected)
    assert rest_state(jumps).height == pytest.approx(expected), "in the air as on the floor"
    own, front = rest_state(jumps), rest_state(jumps, heading=0.0)
    assert own.heading == pytest.approx(0.8)
    np.testing.assert_allclose(own.positions, jumps.seen, atol=1e-12)
    assert front.heading == 0.0
    np.testing.assert_allclose(front.positions, pose(T_POSE, moved=(0.0, 0.4, 0.0)), atol=1e-12)


@pytest.mark.parametrize(("lowest", "sole"), [(0.08, 0.08), (-0.3, 0.0), (1.1, 0.15)])
def test_a_skeleton_that_does_not_stand_at_rest_tells_little_of_its_soles(
    lowest: float, sole: float
) -> None:
    places = BODY.rest_positions.copy()
    places[:, 1] += lowest - places[:, 1].min()
    performer = Performer(Skeleton(BODY.names, BODY.parents, places))
    assert performer.follow(frame(pose())).sole == pytest.approx(sole)


def test_joints_that_are_not_seen_are_filled() -> None:
    performer = Performer(BODY)
    performer.follow(frame(pose(T_POSE)))
    hidden = pose(T_POSE, moved=(0.5, 0.0, 0.0))
    arm = [BODY.index(name) for name in ("ElbowLeft", "WristLeft", "HandLeft")]
    hidden[arm] = np.nan
    seen = performer.follow(frame(hidden, 0.03))
    assert np.flatnonzero(seen.filled).tolist() == sorted(arm)
    np.testing.assert_allclose(seen.seen, pose(T_POSE, moved=(0.5, 0.0, 0.0)), atol=1e-9)
    nothing = performer.follow(frame(np.full((len(BODY.names), 3), np.nan), 0.06))
    assert np.isfinite(nothing.seen).all()
    assert nothing.filled.all()
    assert np.isfinite(Performer(BODY).follow(frame(np.full_like(hidden, np.nan))).seen).all()


def test_a_limb_leaves_the_collar_bone_behind() -> None:
    performer = Performer(BODY)

    def chain(*names: str) -> tuple[int, ...]:
        return tuple(map(BODY.index, names))

    arm = chain("ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft")
    leg = chain("HipRight", "KneeRight", "AnkleRight", "FootRight")
    spine = chain("SpineBase", "SpineMid", "SpineShoulder", "Neck", "Head")
    assert performer.limb(chain("SpineShoulder") + arm) == arm
    assert performer.limb(chain("SpineBase") + leg) == leg
    assert performer.limb(arm) == arm
    assert performer.limb(spine) == spine
    assert performer.limb(arm[1:]) == arm[1:], "what begins further out is left as it is"
    joined = chain("SpineShoulder", "ShoulderLeft")
    assert performer.limb(joined) == joined, "two joints are left at least"


def test_a_collar_bone_with_a_joint_of_its_own_is_left_behind_too() -> None:
    names = ("Hips", "Spine", "Neck", "Head")
    names += tuple(
        f"{side}{part}" for side in ("Left", "Right") for part in ("Shoulder", "Arm", "ForeArm")
    )
    names += tuple(f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg"))
    parents = np.array([-1, 0, 1, 2, 1, 4, 5, 1, 7, 8, 0, 10, 0, 12])
    places = np.array(
        [[0, 1.0, 0], [0, 1.4, 0], [0, 1.5, 0], [0, 1.7, 0]]
        + [[s * x, 1.4, 0] for s in (1, -1) for x in (0.1, 0.2, 0.5)]
        + [[s * 0.1, y, 0] for s in (1, -1) for y in (0.9, 0.5)]
    )
    performer = Performer(Skeleton(names, parents, places))
    assert performer.limb((1, 4, 5, 6)) == (5, 6)
    assert performer.limb((0, 10, 11)) == (10, 11)


@pytest.mark.parametrize(
    ("source", "there", "missing"),
    [
        ("left-arm", {"ShoulderLeft", "ElbowLeft", "WristLeft"}, {"ShoulderRight", "HipLeft"}),
        ("legs", {"HipLeft", "KneeRight", "SpineBase"}, {"ShoulderLeft", "Head"}),
        ("whole", {"HandLeft", "FootRight", "Head"}, {"LeftIndexTip"}),
        ("right-hand", {"RightIndexTip", "RightThumbTip"}, {"ElbowRight", "LeftIndexTip"}),
        ("Head,spine", {"Head", "SpineMid"}, {"HipLeft"}),
    ],
)
def test_a_source_chooses_its_joints(source: str, there: set[str], missing: set[str]) -> None:
    performer = Performer(BODY, source)
    names = {BODY.names[joint] for joint in performer.joints}
    assert there <= names
    assert not missing & names
    tree = performer.rest_tree()
    np.testing.assert_array_equal(tree.positions, BODY.rest_positions[performer.joints])
    for joint, parent in enumerate(tree.parents.tolist()):
        above = performer.joints[joint]
        while parent >= 0 and above != performer.joints[parent]:
            above = int(BODY.parents[above])
            assert above >= 0, "hung on one that is no ancestor"


def test_a_finger_alone_has_no_heading() -> None:
    finger = Skeleton(("a", "b", "c"), np.array([-1, 0, 1]), np.eye(3))
    alone = Performer(finger)
    poses = [np.eye(3), turned(np.eye(3), 1.0, np.zeros(3))]
    for before, after in pairwise(poses):
        assert alone.follow(frame(before)).heading == alone.follow(frame(after, 0.1)).heading == 0.0


@pytest.mark.parametrize("source", ["tentacle", "", "Wrist", "left-arm,tail", "Left"])
def test_an_unknown_source_is_told_in_one_line(source: str) -> None:
    with pytest.raises(InputError, match="--source") as told:
        Performer(BODY, source)
    assert "\n" not in str(told.value)


def test_no_frame_of_a_show_waits_for_a_compiler() -> None:
    # In an interpreter of its own, where no other test has called what is compiled.
    show = """
import gc
import numpy as np
from numba.core.dispatcher import Dispatcher
from replay.builtin import builtin_recording
from runtime.conditioning.switches import SWITCHES, Conditioning
from runtime.driving.performer import Performer

def ready():
    found = (each for each in gc.get_objects() if isinstance(each, Dispatcher))
    return {each.py_func.__qualname__: each.signatures for each in found if each.signatures}

recording = builtin_recording("show")
switches = Conditioning(*[True] * len(SWITCHES))
performer = Performer(recording.skeleton, conditioning=switches)
before = ready()
for index in range(200):
    frame = recording.frame(index)
    positions = frame.positions.copy()
    positions[index % 7 : index % 11] = np.nan
    positions[index % 50] += index % 3
    performer.follow(type(frame)(frame.time, positions, None, frame.confidence))
    if index % 40 == 20:
        switches.switch(SWITCHES[2 + index // 40])
assert len(before) > 10, before
assert ready() == before, ready().keys() - before.keys()
assert max(map(len, before.values())) == 1, before
"""
    run = subprocess.run(
        [sys.executable, "-c", show],
        cwd=Path(__file__).resolve().parents[3],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
