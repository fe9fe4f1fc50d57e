"""The built-in performer: a body of constant bones, smooth motion that loops, a steady stream."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import devices.builtin.simulator
from devices.builtin.body import FINGERS, SIDES, builtin_skeleton, finger_joints
from devices.builtin.gestures import RATE, BuiltinMotion, Gesture, MotionClip, sample_motion, swing
from devices.builtin.motions import MOTIONS, motion_clip
from devices.errors import InputError
from devices.stream import open_stream
from replay.builtin import builtin_recording


@pytest.fixture(scope="module", params=MOTIONS)
def act(request: pytest.FixtureRequest) -> MotionClip:
    return motion_clip(request.param)


def looped(values: np.ndarray, times: int = 3) -> np.ndarray:
    return np.concatenate([values, values[:times]])


def test_bones_keep_their_length(act: MotionClip) -> None:
    parents = act.skeleton.parents
    child = np.flatnonzero(parents >= 0)
    rest = act.skeleton.rest_positions
    expected = np.linalg.norm(rest[child] - rest[parents[child]], axis=1)
    lengths = np.linalg.norm(act.positions[:, child] - act.positions[:, parents[child]], axis=2)
    assert np.abs(lengths - expected).max() < 1e-9


def test_rotations_carry_the_rest_bones_to_where_the_joints_are(act: MotionClip) -> None:
    rest, parents = act.skeleton.rest_positions, act.skeleton.parents
    for joint in np.flatnonzero(parents >= 0):
        bone = rest[joint] - rest[parents[joint]]
        turned = Rotation.from_quat(act.rotations[:, parents[joint]]).apply(bone)
        seen = act.positions[:, joint] - act.positions[:, parents[joint]]
        assert np.abs(seen - turned).max() < 1e-9


def test_the_motion_has_no_jump_nor_jolt_and_loops(act: MotionClip) -> None:
    velocity = np.diff(looped(act.positions), axis=0) * RATE
    acceleration = np.diff(velocity, axis=0) * RATE
    assert np.linalg.norm(velocity, axis=2).max() < 7.0
    assert np.linalg.norm(acceleration, axis=2).max() < 90.0
    seam = np.linalg.norm(act.positions[0] - act.positions[-1], axis=1).max()
    assert seam < 0.005


def test_it_starts_at_rest_with_open_arms(act: MotionClip) -> None:
    assert np.abs(act.positions[0] - act.skeleton.rest_positions).max() < 0.05
    skeleton = act.skeleton
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        shoulder, wrist = (skeleton.index(f"{part}{side}") for part in ("Shoulder", "Wrist"))
        arm = act.positions[0, wrist] - act.positions[0, shoulder]
        angle = np.degrees(np.arctan2(-arm[1], sign * arm[0]))
        assert 35.0 < angle < 55.0


def test_a_foot_stays_on_the_floor(act: MotionClip) -> None:
    feet = [act.skeleton.index(f"Foot{side}") for side in SIDES]
    lowest = act.positions[:, feet, 1].min(axis=1)
    assert lowest.min() > 0.0
    assert lowest.max() < 0.05
    assert act.positions[..., 1].min() > 0.0


def test_each_act_moves_what_it_is_named_after() -> None:
    def travel(name: str, joint: str) -> float:
        act = motion_clip(name)
        path = act.positions[:, act.skeleton.index(joint)]
        return float(np.ptp(path, axis=0).max())

    assert travel("wave", "HandRight") > 0.5
    assert travel("wave", "HandLeft") < 0.2
    assert min(travel("arms", f"Hand{side}") for side in SIDES) > 0.8
    assert min(travel("walk", f"Knee{side}") for side in SIDES) > 0.25
    assert travel("bow", "Head") > 0.4
    played_fingers = motion_clip("fingers")
    for side in SIDES:
        hand = played_fingers.skeleton.index(f"Hand{side}")
        for finger in FINGERS:
            tip = played_fingers.skeleton.index(finger_joints(side, finger)[-1])
            reach = np.linalg.norm(
                played_fingers.positions[:, tip] - played_fingers.positions[:, hand], axis=1
            )
            assert np.ptp(reach) > 0.008


def test_the_body_is_symmetric_and_left_is_plus_x() -> None:
    skeleton = builtin_skeleton()
    for joint, name in enumerate(skeleton.names):
        if "Left" in name:
            other = skeleton.index(name.replace("Left", "Right"))
            mirrored = skeleton.rest_positions[other] * [-1.0, 1.0, 1.0]
            assert skeleton.rest_positions[joint] == pytest.approx(mirrored, abs=1e-12)
            assert skeleton.rest_positions[joint, 0] > 0.0


def test_a_gesture_eases_with_continuous_acceleration() -> None:
    times = np.linspace(0.0, 4.0, 4001)
    out = swing(Gesture("Head", (1.0, 0.0, 0.0), begin=1.0, end=2.5, ease=0.6), times)
    assert out[times < 0.8].max() == 0.0 == out[times < 0.8].min()
    assert out.min() < -0.02
    assert out[np.searchsorted(times, 2.3)] == pytest.approx(1.0, abs=1e-9)
    assert np.abs(out[times > 3.2]).max() < 1e-12
    acceleration = np.diff(out, n=2) / 1e-3**2
    assert np.abs(np.diff(acceleration)).max() < 5e-2 * np.abs(acceleration).max()


def test_what_outlasts_the_act_goes_on_at_its_beginning() -> None:
    late = Gesture("Neck", (0.5, 0.0, 0.0), begin=0.6, end=0.9, ease=0.4)
    frames = sample_motion(BuiltinMotion(1.0, (late,)))
    head = frames.positions[:, frames.skeleton.index("Head")]
    assert np.abs(head[0] - frames.skeleton.rest_positions[frames.skeleton.index("Head")]).max() > 0
    assert np.linalg.norm(head[0] - head[-1]) < 0.02


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_the_stream_gives_each_frame_once_and_in_time() -> None:
    clock = Clock()
    stream = devices.builtin.simulator.Simulator(motion_clip("wave"), clock)
    frames = []
    for _ in range(100):
        frames += stream.poll()
        clock.now += 0.011
    times = np.array([frame.time for frame in frames])
    assert len(frames) == int(99 * 0.011 * RATE) + 1
    assert np.diff(times) == pytest.approx(np.full(len(times) - 1, 1.0 / RATE), abs=1e-9)
    assert times[0] == 100.0
    assert all(frame.time <= frame.arrival + 1e-6 for frame in frames)
    assert not stream.ended
    first = motion_clip("wave").positions[0]
    assert np.array_equal(frames[0].positions, first)


def test_the_stream_loops_and_forgets_a_long_absence() -> None:
    clock = Clock()
    act = motion_clip("bow")
    stream = devices.builtin.simulator.Simulator(act, clock)
    stream.poll()
    clock.now += len(act.times) / RATE
    last = stream.poll()[-1]
    assert np.array_equal(last.positions, act.positions[0])
    clock.now += 3600.0
    late = stream.poll()
    assert len(late) == RATE
    assert late[-1].time == pytest.approx(clock.now, abs=1.0 / RATE)
    assert list(stream.poll()) == []


def test_addresses_open_the_acts() -> None:
    with open_stream("sim://") as stream, open_stream("sim://walk") as walk:
        assert stream.skeleton.names == walk.skeleton.names
        assert len(walk.poll()) == 1
    assert walk.ended
    assert list(walk.poll()) == []
    with pytest.raises(InputError, match=r"'fly'.*show, arms, walk, wave, fingers"):
        open_stream("sim://fly")


def test_the_recording_is_the_same_performance() -> None:
    recording = builtin_recording()
    act = motion_clip("show")
    assert 12.0 < recording.seconds < 18.0
    assert np.array_equal(recording.positions, act.positions)
    assert recording.rotations is not None
    assert (recording.confidence == 1.0).all()
    assert np.linalg.norm(recording.rotations, axis=2) == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(InputError, match="no built-in motion"):
        builtin_recording("nonsense")


def test_several_performers_stand_side_by_side_at_the_same_times() -> None:
    now = [100.0]
    act = motion_clip("wave")
    with devices.builtin.simulator.Simulator(act, lambda: now[0], performers=4) as stream:
        stream.poll()
        now[0] += 1.0
        frames = stream.poll()
    assert [frame.performer for frame in frames] == [0, 1, 2, 3] * 60
    hips = [frame.positions[act.skeleton.root, 0] for frame in frames[:4]]
    assert np.diff(sorted(hips)).min() > 1.0
    alone = {frame.time: frame for frame in frames if frame.performer == 0}
    assert len(alone) == 60
    np.testing.assert_array_equal(frames[0].positions, act.positions[1])


@pytest.mark.parametrize("wrong", ["0", "-1", "many", "65", "9" * 5000, "²"])
def test_a_strange_number_of_performers_is_refused(wrong: str) -> None:
    with pytest.raises(InputError, match="whole number from 1 to 64"):
        open_stream(f"sim://wave?performers={wrong}")
