"""A body's frames through all steps: what faults become, and that clean ones stay as they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from devices.errors import InputError
from devices.skeleton import Skeleton, SkeletonFrame
from replay.builtin import builtin_recording
from replay.formats import read_recording
from replay.recording import Recording
from runtime.conditioning.body_anatomy import body_anatomy
from runtime.conditioning.conditioner import ConditionedFrame, Conditioner
from runtime.conditioning.mirror import mirrored
from runtime.conditioning.switches import (
    SWITCHES,
    Conditioning,
    asked_for,
    filled_only,
    for_live,
    for_recording,
)
from tests.runtime.stick_figures import BODY, T_POSE, pose

STEP = 1 / 30
HANGING = {"ShoulderLeft": (0.0, 0.0, -0.7), "ShoulderRight": (0.0, 0.0, 0.7)}
ONLY = filled_only


def frame(positions: np.ndarray, time: float) -> SkeletonFrame:
    seen = np.isfinite(positions).all(axis=1)
    return SkeletonFrame(time, positions, None, seen.astype(float))


def conditioned(
    frames: Sequence[SkeletonFrame], switches: Conditioning, skeleton: Skeleton = BODY
) -> list[ConditionedFrame]:
    conditioner = Conditioner(skeleton, switches)
    return [conditioner.condition(each) for each in frames]


def places(frames: Sequence[ConditionedFrame]) -> np.ndarray:
    return np.array([each.positions for each in frames])


def frames_of(recording: Recording, most: int = 400) -> list[SkeletonFrame]:
    return [recording.frame(index) for index in range(min(len(recording), most))]


def show(count: int = 240, every: int = 2) -> list[SkeletonFrame]:
    """What ships, at 30 frames a second."""
    recording = builtin_recording("show")
    return [recording.frame(index) for index in range(0, every * count, every)]


def test_what_is_clean_passes_a_recordings_conditioning_to_the_last_bit() -> None:
    recording = builtin_recording("show")
    frames = frames_of(recording, 600)
    for each, out in zip(
        frames, conditioned(frames, for_recording(), recording.skeleton), strict=True
    ):
        np.testing.assert_array_equal(out.positions, each.positions)
        assert not (out.filled | out.corrected | out.predicted).any()
        assert (out.mirrored, out.scale) == (False, 1.0)


def test_what_is_clean_is_hardly_changed_by_a_live_streams_conditioning() -> None:
    frames = show()
    out = places(conditioned(frames, for_live(), builtin_recording("show").skeleton))
    raw = np.array([each.positions for each in frames])
    assert np.linalg.norm(out - raw, axis=2).mean() < 0.015
    still = np.linalg.norm(np.diff(raw, axis=0), axis=2)[:20].max()
    assert np.abs(out - raw)[:20].max() < 0.02 + still


@pytest.mark.parametrize(
    "name",
    [
        "bvh/cmu1_jumping_jacks_animdraw.bvh",
        "bvh/cmu_01_01_forward_jumps.bvh",
        "bvh/mixamo_joe_walk_in_circle.bvh",
        "bvh/fair1_dab.bvh",
        "bvh/pymo_8walk_meredith.bvh",
        "leap/leapjs_playback/wave.json.lz",
    ],
)
def test_clean_motion_capture_passes_to_the_last_bit(shared: Path, name: str) -> None:
    recording = read_recording(shared / name)
    for each, out in zip(
        frames_of(recording),
        conditioned(frames_of(recording), for_recording(), recording.skeleton),
        strict=True,
    ):
        np.testing.assert_array_equal(out.positions, each.positions)


def jumps(positions: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=2).max())


def jitter(positions: np.ndarray) -> float:
    return float(np.sqrt((np.diff(positions, 2, axis=0) ** 2).sum(axis=2).mean()))


def test_a_glitchy_kinect_is_calmed(shared: Path) -> None:
    """Its hidden legs jump by a metre and a half."""
    recording = read_recording(shared / "kinect/v2_laban/joints.csv")
    out = conditioned(frames_of(recording), for_recording(), recording.skeleton)
    assert jumps(recording.positions) > 1.5
    assert jumps(places(out)) < 0.6
    assert jitter(places(out)) < 0.6 * jitter(recording.positions)
    touched = np.mean([each.corrected.any() for each in out])
    assert 0.0 < touched < 0.2, "and most frames are as they were"


def test_two_people_under_one_number_are_told_apart(shared: Path) -> None:
    """In a part of this one, every other capture is of somebody else."""
    recording = read_recording(shared / "kinect/v1_utkinect/joints_s03_e01.txt")
    frames = [recording.frame(index) for index in range(480, 530)]
    out = conditioned(frames, for_recording(), recording.skeleton)
    assert jumps(recording.positions[480:530]) > 1.4
    assert jumps(places(out)) < 0.6


# --- faults put into clean motion -------------------------------------------------------------


def clean(shared: Path) -> Recording:
    return read_recording(shared / "bvh/cmu1_jumping_jacks_animdraw.bvh")


def spoilt(
    recording: Recording, at: slice, spoil: Callable[[np.ndarray], np.ndarray]
) -> list[SkeletonFrame]:
    frames = frames_of(recording)
    for index in range(*at.indices(len(frames))):
        positions = spoil(frames[index].positions.copy())
        seen = np.isfinite(positions).all(axis=1)
        frames[index] = replace(frames[index], positions=positions, confidence=seen.astype(float))
    return frames


def limb(recording: Recording, *words: str) -> np.ndarray:
    names = recording.skeleton.names
    return np.array([k for k, name in enumerate(names) if all(w in name for w in words)])


@pytest.mark.parametrize("which", ["whole", "arms", "legs"])
@pytest.mark.parametrize("count", [1, 8])
def test_exchanged_limbs_are_put_right(shared: Path, which: str, count: int) -> None:
    recording = clean(shared)
    body = body_anatomy(recording.skeleton)
    arms, legs = np.isin(body.group, (0, 1, 2)), np.isin(body.group, (3, 4, 5))
    chosen = {"whole": arms | legs, "arms": arms, "legs": legs}[which]
    assert chosen.sum() > 4

    def exchange(positions: np.ndarray) -> np.ndarray:
        return np.where(chosen[:, None], positions[body.partner], positions)

    at = slice(40, 40 + count)
    frames = spoilt(recording, at, exchange)
    out = conditioned(frames, for_recording(), recording.skeleton)
    error = np.linalg.norm(places(out) - recording.positions, axis=2)
    raw = np.linalg.norm(np.array([f.positions for f in frames]) - recording.positions, axis=2)
    assert raw.max() > 0.5
    assert error.max() < 0.2
    assert error[at].mean() < 0.1 * raw[at].mean()
    ends = chosen & (raw[at].min(axis=0) > 0.25)
    assert np.array([each.corrected for each in out[at]])[:, ends].all(), "and it is told"
    assert not any(each.corrected.any() for each in out[:40])


def test_a_device_that_insists_is_believed_in_the_end(shared: Path) -> None:
    recording = clean(shared)
    partner = body_anatomy(recording.skeleton).partner
    frames = spoilt(recording, slice(20, 125), lambda positions: positions[partner])
    out = conditioned(frames, for_recording(), recording.skeleton)
    # It had said otherwise for 20 frames: 0.67 s.
    np.testing.assert_array_equal(out[-1].positions, frames[-1].positions)
    assert out[25].corrected.any()


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("words", [("LFingers",), ("RightElbow",), ("Head",), ("LeftAnkle",)])
def test_outliers_are_not_believed(shared: Path, count: int, words: tuple[str, ...]) -> None:
    recording = clean(shared)
    joint = limb(recording, *words)[0]

    def push(positions: np.ndarray) -> np.ndarray:
        positions[joint] += [0.9, 0.7, -0.8]
        return positions

    at = slice(60, 60 + count)
    out = conditioned(spoilt(recording, at, push), for_recording(), recording.skeleton)
    error = np.linalg.norm(places(out) - recording.positions, axis=2)
    assert error.max() < 0.25
    assert all(each.filled[joint] and each.corrected[joint] for each in out[at])
    names, parents = recording.skeleton.names, recording.skeleton.parents
    toes = [k for k in range(len(names)) if "Toe" in names[k] and joint in (parents[k], k - 2)]
    other = ~np.isin(np.arange(len(names)), [joint, *toes])  # a foot goes along with its ankle
    assert error[:60].max() == 0.0
    assert error[:, other].max() < 1e-12


def test_a_joint_that_stays_where_it_jumped_is_believed_there() -> None:
    there = pose(T_POSE)
    moved = there.copy()
    head = BODY.index("Head")
    moved[head] += [0.0, 0.0, 0.7]
    frames = [frame(there, i * STEP) for i in range(20)]
    frames += [frame(moved, (20 + i) * STEP) for i in range(20)]
    out = conditioned(frames, for_recording())
    assert out[21].corrected[head]
    np.testing.assert_array_equal(out[-1].positions, moved)
    assert jumps(places(out)) < 0.35, "and goes there within a moment"


def test_a_bone_that_shrinks_is_not_believed() -> None:
    there = pose(T_POSE)
    shrunk = there.copy()
    knee, hip = BODY.index("KneeLeft"), BODY.index("HipLeft")
    beyond = [BODY.index("AnkleLeft"), BODY.index("FootLeft")]
    shrunk[[knee, *beyond]] = there[hip] - [0.0, 0.05, 0.0]
    # Slowly, so that nothing jumps.
    frames = [frame(there, i * STEP) for i in range(20)]
    frames += [
        frame(there + min(1.0, i / 8) * (shrunk - there), (20 + i) * STEP) for i in range(20)
    ]
    out = conditioned(frames, for_recording())
    assert out[29].corrected[[knee, *beyond]].all()
    assert np.linalg.norm(out[29].positions[knee] - there[knee]) < 0.2


@pytest.mark.parametrize("count", [1, 10, 300])
def test_a_lost_arm_is_held_then_rests_and_comes_back(count: int) -> None:
    up = pose({"ShoulderLeft": (0.0, 0.0, 1.5)})
    arm = [BODY.index(f"{part}Left") for part in ("Elbow", "Wrist", "Hand")]
    hidden = up.copy()
    hidden[arm] = np.nan
    frames = [frame(up, i * STEP) for i in range(20)]
    frames += [frame(hidden, (20 + i) * STEP) for i in range(count)]
    frames += [frame(up, (20 + count + i) * STEP) for i in range(10)]
    out = conditioned(frames, for_recording())
    lost = out[19 + count]
    assert lost.filled[arm].all()
    if count <= 10:
        np.testing.assert_allclose(lost.positions, up, atol=1e-9)
    else:
        assert np.linalg.norm(lost.positions - up, axis=1)[arm].max() > 0.3
    np.testing.assert_array_equal(out[-1].positions, up)
    assert jumps(places(out)) < 0.4


# --- smoothing, prediction, and the stage's space ---------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    arrays(
        np.float64,
        (5, len(BODY.names), 3),
        elements=st.floats(allow_nan=True, allow_infinity=True, width=64) | st.floats(-2.0, 2.0),
    ),
    arrays(np.float64, 5, elements=st.floats(-1e6, 1e6) | st.floats(0.0, 0.2)),
    st.lists(st.booleans(), min_size=len(SWITCHES), max_size=len(SWITCHES)),
)
def test_nothing_that_leaves_is_nan(
    positions: np.ndarray, times: np.ndarray, on: list[bool]
) -> None:
    conditioner = Conditioner(BODY, Conditioning(*on))
    for place, time in zip(positions, times, strict=True):
        out = conditioner.condition(SkeletonFrame(time, place, None, np.zeros(len(BODY.names))))
        assert np.isfinite(out.positions).all()


@pytest.mark.parametrize("switches", [for_live(), for_recording(), ONLY()])
def test_a_frame_of_another_skeleton_is_refused(switches: Conditioning) -> None:
    for count in (len(BODY.names) - 1, len(BODY.names) + 1):
        other = SkeletonFrame(0.0, np.zeros((count, 3)), None, np.ones(count))
        with pytest.raises(ValueError, match=rf"got \({count}, 3\)"):
            Conditioner(BODY, switches).condition(other)


@settings(max_examples=40, deadline=None)
@given(arrays(np.float64, (len(BODY.names), 3), elements=st.floats(-5.0, 5.0)))
def test_the_mirror_twice_is_as_before(positions: np.ndarray) -> None:
    partner = body_anatomy(BODY).partner
    np.testing.assert_array_equal(mirrored(mirrored(positions, partner), partner), positions)
    assert (partner != np.arange(len(BODY.names))).sum() >= 16


def test_in_the_mirror_left_is_right_and_limbs_do_not_cross() -> None:
    raised = pose({"ShoulderLeft": (0.0, 0.0, 1.0)}, moved=(0.4, 0.0, 0.0))
    hidden = raised.copy()
    left, right = BODY.index("HandLeft"), BODY.index("HandRight")
    hidden[left] = np.nan
    out = conditioned([frame(hidden, 0.0)], Conditioning(*[n == "mirror" for n in SWITCHES]))[0]
    assert out.mirrored
    assert out.filled[right]
    assert not out.filled[left]
    np.testing.assert_allclose(out.positions[left], raised[right] * [-1, 1, 1])
    hips = [BODY.index(f"Hip{side}") for side in ("Left", "Right")]
    assert out.positions[hips[0], 0] > out.positions[hips[1], 0], "left is still at +X"


@pytest.mark.parametrize("switch", ["filter", "predict"])
def test_a_pose_that_is_held_is_not_moved(switch: str) -> None:
    still = [frame(pose(T_POSE), i * STEP) for i in range(30)]
    out = conditioned(still, Conditioning(*[n == switch for n in SWITCHES]))
    np.testing.assert_array_equal(out[-1].positions, pose(T_POSE))
    assert out[-1].predicted.all() == (switch == "predict")


def test_noise_is_reduced_on_a_real_recording(shared: Path) -> None:
    recording = read_recording(shared / "kinect/v2_laban/Ges03_drawlines.csv")
    switches = for_recording()
    switches.filter = True
    out = places(conditioned(frames_of(recording), switches, recording.skeleton))
    assert jitter(out) < 0.75 * jitter(recording.positions)
    assert np.linalg.norm(out - recording.positions, axis=2).mean() < 0.01


def test_switches_may_be_turned_while_it_runs_without_a_jump() -> None:
    frames = show(300)
    for name in ("swaps", "outliers", "filter", "predict", "identities", "order"):
        switches = for_recording()
        conditioner = Conditioner(builtin_recording("show").skeleton, switches)
        out = []
        for index, each in enumerate(frames):
            if index % 40 == 20:
                switches.switch(name)
            out.append(conditioner.condition(each).positions)
        raw = jumps(np.array([each.positions for each in frames]))
        assert jumps(np.array(out)) < 1.6 * raw, name


def test_a_tilted_and_lowered_floor_is_made_level() -> None:
    angle = 0.2
    turn = np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    )
    switches = ONLY()
    switches.level = True
    conditioner = Conditioner(BODY, switches)
    feet = [BODY.index(f"Foot{side}") for side in ("Left", "Right")]
    for index in range(1200):
        # Stands for a second here and there within four metres, and goes there in no time.
        x, z = np.random.default_rng(index // 30).uniform(-2.0, 2.0, 2)
        true = pose(T_POSE, moved=(x, 0.0, z))
        out = conditioner.condition(frame(true @ turn.T - [0.0, 0.9, 0.0], index * STEP))
        if index > 900:
            heights = out.positions[feet, 1] - BODY.rest_positions[feet, 1]
            np.testing.assert_allclose(heights, 0.0, atol=0.06)
            up = out.positions[BODY.index("Head")] - out.positions[BODY.index("SpineBase")]
            assert up[1] / np.linalg.norm(up) > np.cos(0.05)


def test_a_jump_does_not_raise_the_floor() -> None:
    switches = ONLY()
    switches.level = True
    conditioner = Conditioner(BODY, switches)
    for index in range(300):
        air = max(0.0, 0.6 * np.sin(index * 0.2)) if index > 90 else 0.0
        out = conditioner.condition(frame(pose(T_POSE, moved=(0.0, air, 0.0)), index * STEP))
        np.testing.assert_allclose(out.positions, pose(T_POSE, moved=(0.0, air, 0.0)), atol=0.03)


@pytest.mark.parametrize("size", [0.6, 1.0, 1.3])
def test_everybody_is_as_tall_as_the_rest_pose(size: float) -> None:
    switches = ONLY()
    switches.scale = True
    frames = [frame(pose(T_POSE) * size, i * STEP) for i in range(60)]
    out = conditioned(frames, switches)
    np.testing.assert_allclose(out[-1].positions, pose(T_POSE), atol=1e-6)
    assert out[-1].scale == pytest.approx(1.0 / size)


@pytest.mark.parametrize("shape", [T_POSE, {}])
def test_a_pose_held_for_a_second_calibrates_once(shape: dict[str, tuple[float, ...]]) -> None:
    switches = ONLY()
    switches.recalibrate = True
    conditioner = Conditioner(BODY, switches)

    def held(positions: np.ndarray, times: range) -> list[bool]:
        asked = []
        for index in times:
            conditioner.condition(frame(positions, index * STEP))
            asked.append(conditioner.calibrates)
        return asked

    assert sum(held(pose(shape), range(28))) == 0, "not yet a second"
    assert sum(held(pose(shape), range(28, 120))) == 1
    assert sum(held(pose(HANGING), range(120, 200))) == 0, "arms that hang ask for nothing"
    assert sum(held(pose(shape), range(200, 260))) == 1
    switches.recalibrate = False
    held(pose(HANGING), range(260, 300))
    assert sum(held(pose(shape), range(300, 400))) == 0


def test_a_pose_that_is_not_held_still_asks_for_nothing() -> None:
    switches = ONLY()
    switches.recalibrate = True
    conditioner = Conditioner(BODY, switches)
    for index in range(120):
        lean = 0.3 * np.sin(index * 0.5)
        conditioner.condition(frame(pose(T_POSE, moved=(lean, 0.0, 0.0)), index * STEP))
        assert not conditioner.calibrates


def test_an_unknown_switch_is_told_in_one_line() -> None:
    switches = Conditioning()
    assert switches.switch("mirror")
    assert not switches.switch("mirror", False)
    with pytest.raises(InputError, match=r"smoothness.*filter"):
        switches.switch("smoothness")
    assert asked_for(Conditioning(), {"filter": False, "mirror": None}).filter is False


def test_performers_without_end_are_forgotten() -> None:
    conditioner = Conditioner(BODY, for_live())
    for number in range(200):
        each = replace(frame(pose(T_POSE), 0.01 * number), performer=number)
        assert np.isfinite(conditioner.condition(each).positions).all()
    assert len(conditioner._memories) == 64
